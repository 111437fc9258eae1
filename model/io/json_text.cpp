#include "model/io/json_text.h"

#include <fmt/format.h>

#include "model/printable.h"

namespace cutproof::io {
namespace {

using nlohmann::json;

bool holds_utf8(const json& value) {
  if (value.is_string()) return is_utf8(value.get_ref<const std::string&>());
  if (!value.is_structured()) return true;
  for (const auto& [key, entry] : value.items()) {
    if ((value.is_object() && !is_utf8(key)) || !holds_utf8(entry)) return false;
  }
  return true;
}

// The same with bytes that are not UTF-8 written out.
json as_utf8(const json& value) {
  if (value.is_string()) {
    const auto& text = value.get_ref<const std::string&>();
    return is_utf8(text) ? text : printable(text);
  }
  if (!value.is_structured()) return value;
  json result = value.is_object() ? json::object() : json::array();
  for (const auto& [key, entry] : value.items()) {
    if (value.is_object()) {
      result[is_utf8(key) ? key : printable(key)] = as_utf8(entry);
    } else {
      result.push_back(as_utf8(entry));
    }
  }
  return result;
}

// Of JSON: unprintable characters occur only within texts, where their numbers may replace them.
std::string with_numbers(std::string_view text) {
  std::string result;
  while (!text.empty()) {
    const Character next = first_character(text);
    if (is_printable(next.code) || next.code == '\n') {
      result += text.substr(0, next.bytes);
    } else if (next.code < 0x10000) {
      result += fmt::format("\\u{:04x}", next.code);
    } else {
      const uint32_t rest = next.code - 0x10000;
      result += fmt::format("\\u{:04x}\\u{:04x}", 0xD800 + (rest >> 10), 0xDC00 + (rest & 0x3FF));
    }
    text.remove_prefix(next.bytes);
  }
  return result;
}

}  // namespace

std::string json_text(const json& document, int indent) {
  return with_numbers(holds_utf8(document) ? document.dump(indent) : as_utf8(document).dump(indent));
}

}  // namespace cutproof::io
