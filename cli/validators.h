// Validators of option values, with messages in words. CLI11's own validators print ranges in hundreds of digits, and
// its conversions read 2^64 as 2^64 - 1, 010 as 8 and nan as a number of seconds.
#pragma once
#include <CLI/CLI.hpp>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

namespace cutproof::cli {

inline constexpr int64_t kMostWhole = std::numeric_limits<int64_t>::max();

// Digits, perhaps with a sign. A bound of kMostWhole is not told.
CLI::Validator whole_number(int64_t least, int64_t most = kMostWhole);
// From 0 to 2^64 - 1.
CLI::Validator seed_number();
// Finite, written in decimals.
CLI::Validator number();
CLI::Validator number_from(double least);
CLI::Validator number_above(double bound);
CLI::Validator number_between(double least, double most);

// One of these words.
CLI::Validator one_of(std::vector<std::string> words);
// Any word; these are those that a shell offers.
CLI::Validator usually_one_of(std::vector<std::string> words);
// The words of an option with one of these two.
std::vector<std::string> words_of(const CLI::Option& option);

// "a, b, c" as a, b and c: lists of names are told that way.
std::vector<std::string> listed(const std::string& names);

}  // namespace cutproof::cli
