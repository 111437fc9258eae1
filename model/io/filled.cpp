#include "model/io/filled.h"

#include <fmt/format.h>

#include <regex>
#include <sstream>

#include "model/printable.h"

namespace cutproof::io {

namespace {

const nlohmann::json& value_at(const std::string& path, const nlohmann::json& values) {
  const nlohmann::json* value = &values;
  std::istringstream names(path);
  for (std::string name; !value->is_null() && std::getline(names, name, '/');) value = &value->at(name);
  return *value;
}

std::string text_of(const nlohmann::json& value, double factor, const std::string& format) {
  if (value.is_null()) return "-";
  if (value.is_boolean()) return value ? "yes" : "no";
  if (value.is_string()) return printable(value.get_ref<const std::string&>());  // begins no line of its own
  if (format.empty()) return value.dump();
  return fmt::format(fmt::runtime("{" + format + "}"), factor * value.get<double>());
}

}  // namespace

std::string filled(const std::string& text, const Figure& figure) {
  static const std::regex kFigure(R"(\{(?:([-.e0-9]+)\*)?([^{}:]+)(:[^{}]*)?\})");
  std::string result;
  auto rest = text.begin();
  for (std::sregex_iterator found(text.begin(), text.end(), kFigure), end; found != end; ++found) {
    const std::smatch& match = *found;
    result.append(rest, match[0].first);
    result += figure(match[2], match[1].matched ? std::stod(match[1]) : 1, match[3]);
    rest = match[0].second;
  }
  return result.append(rest, text.end());
}

std::string filled(const std::string& text, const nlohmann::json& values) {
  return filled(text, [&](const std::string& path, double factor, const std::string& format) {
    return text_of(value_at(path, values), factor, format);
  });
}

}  // namespace cutproof::io
