// A field of a result document, which knows where it stands: what is not as it should be is refused by its path.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "model/error.h"
#include "model/stage.h"

namespace cutproof::report {

struct Field {
  const nlohmann::json* value;  // null: it is not there
  const std::string& file;
  std::string path;
  const char* remedy;  // of every refusal

  // So that no sum of such numbers ends beyond what an integer holds.
  static constexpr int64_t kMostCount = 1'000'000'000'000;

  [[noreturn]] void refuse(const std::string& problem) const { throw InputError(file, path, problem, remedy); }
  Field operator[](const char* name) const {
    if (!there().is_object()) refuse("this is no object");
    const auto found = value->find(name);
    return {found == value->end() ? nullptr : &*found, file, path.empty() ? name : path + "." + name, remedy};
  }
  bool is_there() const { return value != nullptr; }
  bool is_nothing() const { return value == nullptr || value->is_null(); }
  const nlohmann::json& there() const {
    if (value == nullptr) refuse("this is missing");
    return *value;
  }
  std::string text() const {
    if (!there().is_string()) refuse("this is no text");
    return value->get<std::string>();
  }
  std::string text_or(const char* otherwise) const { return value == nullptr ? otherwise : text(); }
  bool flag() const {
    if (!there().is_boolean()) refuse("this is neither true nor false");
    return value->get<bool>();
  }
  bool flag_or(bool otherwise) const { return value == nullptr ? otherwise : flag(); }
  int64_t count() const {
    if (!there().is_number_integer()) refuse("this is no whole number");
    if (value->is_number_unsigned() &&
        value->get<uint64_t>() > static_cast<uint64_t>(std::numeric_limits<int64_t>::max()))
      refuse("this is too large");
    const auto number = value->get<int64_t>();
    if (number < 0) refuse("this is below 0");
    if (number > kMostCount) refuse("this is too large");
    return number;
  }
  int64_t count_or(int64_t otherwise) const { return value == nullptr ? otherwise : count(); }
  // Any number that a seed may be.
  uint64_t seed() const {
    if (!there().is_number_unsigned() && !(value->is_number_integer() && value->get<int64_t>() >= 0))
      refuse("this is no seed");
    return value->get<uint64_t>();
  }
  // A number, or "nan", "inf", "-inf".
  double number() const {
    if (there().is_number()) return value->get<double>();
    if (value->is_string()) {
      const auto& word = value->get_ref<const std::string&>();
      if (word == "nan") return std::numeric_limits<double>::quiet_NaN();
      if (word == "inf") return std::numeric_limits<double>::infinity();
      if (word == "-inf") return -std::numeric_limits<double>::infinity();
    }
    refuse("this is no number");
  }
  std::optional<double> number_or_null() const {
    if (is_nothing()) return std::nullopt;
    const double found = number();
    return std::isfinite(found) ? std::optional(found) : std::nullopt;
  }
  std::size_t length() const {
    if (!there().is_array()) refuse("this is no list");
    return value->size();
  }
  Field at(std::size_t k) const { return {&(*value)[k], file, path + "[" + std::to_string(k) + "]", remedy}; }
  // Every entry of a list.
  template <class Use>
  void each(Use&& use) const {
    const std::size_t count = length();
    for (std::size_t k = 0; k < count; ++k) use(at(k));
  }
  std::vector<std::string> texts() const {
    std::vector<std::string> found;
    for (std::size_t k = 0; value != nullptr && k < length(); ++k) found.push_back(at(k).text());
    return found;
  }
  // At most so many.
  std::vector<int32_t> numbers(std::size_t most) const {
    std::vector<int32_t> found;
    for (std::size_t k = 0; value != nullptr && k < std::min(length(), most); ++k) {
      const nlohmann::json& one = (*value)[k];
      if (!one.is_number_integer() || one.get<int64_t>() < std::numeric_limits<int32_t>::min() ||
          one.get<int64_t>() > std::numeric_limits<int32_t>::max())
        at(k).refuse("this is the number of no particle or cluster");
      found.push_back(one.get<int32_t>());
    }
    return found;
  }
  Stage stage() const {
    const std::string name = text();
    for (const Stage one : kStages) {
      if (name == name_of(one)) return one;
    }
    refuse("'" + name + "' is none of the six stages");
  }
};

}  // namespace cutproof::report
