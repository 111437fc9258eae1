#include "cli/validators.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <charconv>
#include <cmath>
#include <optional>
#include <string_view>
#include <system_error>
#include <type_traits>
#include <utility>

#include "model/nearest_word.h"

namespace cutproof::cli {

namespace {

// Of a validator's name, which is not printed: the words follow it.
constexpr std::string_view kWords = "words:";

std::string quoted_short(const std::string& given) {
  return given.size() > 60 ? fmt::format("'{}…'", given.substr(0, 40)) : fmt::format("'{}'", given);
}

// The whole text as a number; nothing if it is none. `is_out_of_range`: it is one that the type cannot hold.
template <class Number>
std::optional<Number> number_of(std::string_view text, bool& is_out_of_range) {
  if (text.starts_with('+') && text.size() > 1 && text[1] != '-') text.remove_prefix(1);
  Number number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  is_out_of_range = error == std::errc::result_out_of_range && end == text.data() + text.size();
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return number;
}

// CLI11 would read 010 as 8.
bool is_octal(std::string_view given) {
  if (given.starts_with('-') || given.starts_with('+')) given.remove_prefix(1);
  return given.size() > 1 && given[0] == '0';
}

// `wanted`: such as "a whole number from 0 up".
template <class Number, class IsFine>
CLI::Validator validator_of(std::string wanted, IsFine is_fine) {
  return {[wanted = std::move(wanted), is_fine](const std::string& given) -> std::string {
            bool is_out_of_range = false;
            const std::optional<Number> number = number_of<Number>(given, is_out_of_range);
            const bool begins_with_0 = std::is_integral_v<Number> && number && is_octal(given);
            if (number && !begins_with_0 && is_fine(*number)) return {};
            return fmt::format("must be {}, and {} {}", wanted, quoted_short(given),
                               begins_with_0     ? "begins with 0"
                               : number          ? "is not"
                               : is_out_of_range ? "is too large"
                                                 : "is none");
          },
          ""};
}

}  // namespace

CLI::Validator whole_number(int64_t least, int64_t most) {
  const std::string range =
      most == kMostWhole ? fmt::format("from {} up", least) : fmt::format("from {} to {}", least, most);
  return validator_of<int64_t>("a whole number " + range,
                               [=](int64_t given) { return least <= given && given <= most; });
}

CLI::Validator seed_number() {
  return validator_of<uint64_t>(
      fmt::format("a whole number from 0 to {} (2^64 - 1)", std::numeric_limits<uint64_t>::max()),
      [](uint64_t) { return true; });
}

CLI::Validator number() {
  return validator_of<double>("a finite number", [](double given) { return std::isfinite(given); });
}

CLI::Validator number_from(double least) {
  return validator_of<double>(fmt::format("a finite number from {:g} up", least),
                              [=](double given) { return std::isfinite(given) && given >= least; });
}

CLI::Validator number_above(double bound) {
  return validator_of<double>(fmt::format("a finite number above {:g}", bound),
                              [=](double given) { return std::isfinite(given) && given > bound; });
}

CLI::Validator number_between(double least, double most) {
  return validator_of<double>(fmt::format("a number from {:g} to {:g}", least, most),
                              [=](double given) { return given >= least && given <= most; });
}

CLI::Validator one_of(std::vector<std::string> words) {
  const std::string all = fmt::format("{}", fmt::join(words, ", "));
  CLI::Validator validator{[words = std::move(words), all](std::string& given) -> std::string {
                             if (std::find(words.begin(), words.end(), given) != words.end()) return {};
                             return fmt::format("{} is not one of its words: {}use one of {}", quoted_short(given),
                                                did_you_mean(given, words), all);
                           },
                           ""};
  return validator.name(std::string(kWords) + all);
}

CLI::Validator usually_one_of(std::vector<std::string> words) {
  CLI::Validator validator{[](std::string&) { return std::string(); }, ""};
  return validator.name(fmt::format("{}{}", kWords, fmt::join(words, ", ")));
}

std::vector<std::string> words_of(const CLI::Option& option) {
  // CLI11 says by an exception that there is no further one, and has no such function for what is const.
  auto& any = const_cast<CLI::Option&>(option);
  try {
    for (int k = 0;; ++k) {
      const std::string& name = any.get_validator(k)->get_name();
      if (name.starts_with(kWords)) return listed(name.substr(kWords.size()));
    }
  } catch (const CLI::OptionNotFound&) {
    return {};
  }
}

std::vector<std::string> listed(const std::string& names) {
  std::vector<std::string> words;
  for (std::size_t from = 0; from < names.size();) {
    const std::size_t end = std::min(names.find(", ", from), names.size());
    words.push_back(names.substr(from, end - from));
    from = end + 2;
  }
  return words;
}

}  // namespace cutproof::cli
