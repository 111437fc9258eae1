#include "model/io/junit.h"

#include <fmt/format.h>

#include <cmath>
#include <cstddef>
#include <string_view>

#include "model/printable.h"

namespace cutproof::io {
namespace {

// For contents and for attributes: a reader of these turns tabs and line breaks into blanks unless they are written as
// numbers, and everywhere "\r" into "\n".
std::string escaped(std::string_view text, bool in_attribute) {
  std::string result;
  while (!text.empty()) {
    const Character next = first_character(text);
    const std::string_view character = text.substr(0, next.bytes);
    const char first = text[0];
    text.remove_prefix(next.bytes > 0 ? next.bytes : 1);
    const bool is_blank = first == '\t' || first == '\n' || first == '\r';
    if (next.bytes == 0 || !(is_printable(next.code) || is_blank)) {  // much of which XML does not allow at all
      escape_character(next, static_cast<unsigned char>(first), [&](std::string_view escape) { result += escape; });
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

// Contents of a <testcase>: empty, or one element.
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
    if (!suite.properties.empty()) {
      body += "    <properties>\n";
      for (const auto& [name, value] : suite.properties) {
        body += fmt::format("      <property{}{}/>\n", attribute("name", name), attribute("value", value));
      }
      body += "    </properties>\n";
    }
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
