#include "model/io/junit.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <string_view>

namespace cutproof::io {
namespace {

constexpr std::string_view kReplacement = "\xEF\xBF\xBD";  // U+FFFD

struct Decoded {
  uint32_t code = 0;
  std::size_t bytes = 0;  // 0: no character of UTF-8 begins here
};

// The first character of `text`, which is not empty. Overlong forms and halves of surrogate pairs are none.
Decoded first_character(std::string_view text) {
  const auto byte = [&](std::size_t k) { return static_cast<uint32_t>(static_cast<unsigned char>(text[k])); };
  const uint32_t lead = byte(0);
  if (lead < 0x80) return {lead, 1};
  const std::size_t count = lead >> 5 == 0x6 ? 2 : lead >> 4 == 0xE ? 3 : lead >> 3 == 0x1E ? 4 : 0;
  if (count == 0 || count > text.size()) return {};
  uint32_t code = lead & (0x7Fu >> count);
  for (std::size_t k = 1; k < count; ++k) {
    if (byte(k) >> 6 != 0x2) return {};
    code = code << 6 | (byte(k) & 0x3F);
  }
  constexpr std::array<uint32_t, 5> kLeast = {0, 0, 0x80, 0x800, 0x10000};
  if (code < kLeast[count] || code > 0x10FFFF || (code >= 0xD800 && code <= 0xDFFF)) return {};
  return {code, count};
}

// XML 1.0, Char.
bool is_allowed(uint32_t code) {
  return code >= 0x20 ? code != 0xFFFE && code != 0xFFFF : code == '\t' || code == '\n' || code == '\r';
}

// For contents and for attributes: a reader of these turns tabs and line breaks into blanks unless they are written as
// numbers, and everywhere "\r" into "\n".
std::string escaped(std::string_view text, bool in_attribute) {
  std::string result;
  while (!text.empty()) {
    const Decoded next = first_character(text);
    const std::string_view character = text.substr(0, next.bytes);
    text.remove_prefix(next.bytes > 0 ? next.bytes : 1);
    if (next.bytes == 0 || !is_allowed(next.code)) {
      result += kReplacement;
    } else if (next.code == '&') {
      result += "&amp;";
    } else if (next.code == '<') {
      result += "&lt;";
    } else if (next.code == '>') {  // "]]>" may not stand in contents
      result += "&gt;";
    } else if (next.code == '"' && in_attribute) {
      result += "&quot;";
    } else if (next.code == '\r' || (in_attribute && (next.code == '\n' || next.code == '\t'))) {
      result += fmt::format("&#{};", next.code);
    } else {
      result += character;
    }
  }
  return result;
}

std::string attribute(std::string_view name, std::string_view value) {
  return fmt::format(" {}=\"{}\"", name, escaped(value, true));
}

// Never "inf", "nan" or an exponent, which readers of numbers in XML may not know.
std::string time_attribute(double seconds) {
  return fmt::format(" time=\"{:.6f}\"", std::isfinite(seconds) && seconds > 0 ? seconds : 0.0);
}

struct Counts {
  std::size_t tests = 0, failures = 0, errors = 0, skipped = 0;
  void add(const JunitSuite& suite) {
    for (const JunitCase& one : suite.cases) {
      ++tests;
      failures += one.outcome == JunitOutcome::failed;
      errors += one.outcome == JunitOutcome::error;
      skipped += one.outcome == JunitOutcome::skipped;
    }
  }
  std::string attributes() const {
    return fmt::format(" tests=\"{}\" failures=\"{}\" errors=\"{}\" skipped=\"{}\"", tests, failures, errors, skipped);
  }
};

// What stands inside of a <testcase>: nothing, or one element.
std::string inside(const JunitCase& one) {
  const std::string text = escaped(one.text, false);
  switch (one.outcome) {
    case JunitOutcome::passed:
      return text.empty() ? "" : fmt::format("<system-out>{}</system-out>", text);
    case JunitOutcome::failed:
      return fmt::format("<failure{}>{}</failure>", attribute("message", one.message), text);
    case JunitOutcome::error:
      return fmt::format("<error{}>{}</error>", attribute("message", one.message), text);
    case JunitOutcome::skipped:
      return fmt::format("<skipped{}>{}</skipped>", attribute("message", one.message), text);
  }
  return "";
}

}  // namespace

std::string junit_xml(const std::vector<JunitSuite>& suites) {
  Counts all;
  double seconds = 0;
  std::string body;
  for (const JunitSuite& suite : suites) {
    Counts counts;
    counts.add(suite);
    all.add(suite);
    seconds += suite.seconds;
    body += fmt::format("  <testsuite{}{}{}>\n", attribute("name", suite.name), counts.attributes(),
                        time_attribute(suite.seconds));
    for (const JunitCase& one : suite.cases) {
      body += fmt::format("    <testcase{}{}{}>{}</testcase>\n", attribute("name", one.name),
                          attribute("classname", one.class_name), time_attribute(one.seconds), inside(one));
    }
    body += "  </testsuite>\n";
  }
  return fmt::format("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites{}{}>\n{}</testsuites>\n",
                     all.attributes(), time_attribute(seconds), body);
}

}  // namespace cutproof::io
