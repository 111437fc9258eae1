// JUnit XML: the results of tests as continuous integration reads them. Plain data in, text out.
#pragma once
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace cutproof::io {

enum class JunitOutcome {
  passed,
  failed,   // the judged property does not hold
  skipped,  // there was nothing to judge, or the property is not promised
  error     // it could not be judged
};

struct JunitCase {
  std::string name, class_name;
  double seconds = 0;
  JunitOutcome outcome = JunitOutcome::passed;
  std::string message = {};  // one line: why the case did not pass; empty if it passed
  std::string text = {};     // the whole story, and how to see it again
};

struct JunitSuite {
  std::string name;
  double seconds = 0;  // wall time of all cases together
  std::vector<JunitCase> cases = {};
  std::vector<std::pair<std::string, std::string>> properties = {};  // names and values, of the suite as a whole
};

// A document in UTF-8: <testsuites> of <testsuite> of <properties> and <testcase>, with the attributes tests, failures,
// errors, skipped and time of each suite and of all. Characters that XML 1.0 excludes (control characters, bytes that
// are not UTF-8) are replaced by U+FFFD.
std::string junit_xml(const std::vector<JunitSuite>& suites);

}  // namespace cutproof::io
