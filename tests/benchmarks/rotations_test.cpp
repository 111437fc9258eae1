// `cutproof bench rotations`: every method on every case, and no wrong answer that goes uncounted. What the times are
// is not tested.
#include "benchmarks/rotations.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <random>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "fixtures/hard_matrices.h"
#include "harness/backends.h"
#include "model/stop.h"
#include "tests/program.h"

namespace rotations_test {
namespace {

using cutproof::Mat3;
using cutproof::Precision;
using cutproof::benchmarks::RotationCounts;
using cutproof::benchmarks::RotationMethod;
using cutproof::benchmarks::RotationReport;
using cutproof::benchmarks::RotationResult;
using nlohmann::json;

// --- The program -----------------------------------------------------------------------------------------------------

class BenchRotations : public Program {
 protected:
  json bench(const std::string& arguments, Outcome& outcome) const {
    outcome = cutproof("bench rotations --matrices 30 --timed 100 --repeats 3 --json out.json " + arguments,
                       "CUTPROOF_COMMIT=0123456789ab");
    return json::parse(read("out.json"));
  }
};

void expect_times(const json& seconds) {
  EXPECT_GT(seconds.at("min"), 0);
  EXPECT_LE(seconds.at("min"), seconds.at("median"));
  EXPECT_LE(seconds.at("median"), seconds.at("max"));
}

// What docs/reference/schemas/bench_rotations.json promises, for these methods in these precisions and every case.
void expect_complete(const json& document, const std::set<std::pair<std::string, std::string>>& methods) {
  EXPECT_EQ(document.at("format"), "cutproof.bench");
  EXPECT_EQ(document.at("format_version"), 3);
  EXPECT_EQ(document.at("suite"), "rotations");
  EXPECT_EQ(document.at("commit"), "0123456789ab");
  for (const char* text : {"cutproof", "date", "device"}) EXPECT_TRUE(document.at(text).is_string()) << text;
  for (const char* number : {"matrices", "timed", "repeats", "seed"}) {
    EXPECT_TRUE(document.at(number).is_number_integer()) << number;
  }
  EXPECT_TRUE(document.at("complete"));
  EXPECT_TRUE(document.at("holds"));
  EXPECT_GT(document.at("machine_limits").at("copy_bytes_per_second"), 0);
  for (const char* precision : {"single", "double"}) {
    const json& bounds = document.at("bounds").at(precision);
    EXPECT_LE(bounds.at("reference_error").get<double>(), 0.1 * bounds.at("gap").get<double>());
    EXPECT_GT(bounds.at("orthogonality"), 0);
    EXPECT_GT(bounds.at("deviation"), 0);
  }
  std::set<std::string> cases;
  for (const json& entry : document.at("cases")) {
    cases.insert(entry.at("name").get<std::string>());
    EXPECT_TRUE(entry.at("what").is_string() && entry.at("expected").is_string() && entry.at("seed").is_number());
  }
  EXPECT_EQ(cases.size(), cutproof::fixtures::hard_cases().size());

  std::set<std::pair<std::string, std::string>> seen;
  int defaults = 0, front = 0;
  for (const json& method : document.at("methods")) {
    seen.insert({method.at("method").get<std::string>(), method.at("precision").get<std::string>()});
    front += method.at("on_front").get<bool>();
    if (method.at("default")) {
      ++defaults;
      EXPECT_EQ(method.at("wrong"), 0) << method;
      EXPECT_EQ(method.at("precision"), "single");
      EXPECT_LE(method.at("worst_gap"), 1e-6);
      EXPECT_LE(method.at("worst_orthogonality"), 5e-6);
    }
    expect_times(method.at("near_seconds_per_million"));
    expect_times(method.at("cold_seconds_per_million"));
    EXPECT_GT(method.at("limit_seconds_per_million"), 0);
    EXPECT_GT(method.at("multiple_of_limit"), 0);
    EXPECT_EQ(cases.count(method.at("worst_case").get<std::string>()), 1U) << method;
    EXPECT_LE(method.at("wrong"), method.at("answers"));
  }
  EXPECT_EQ(seen, methods);
  EXPECT_EQ(document.at("methods").size(), methods.size());
  EXPECT_EQ(defaults, 1);
  EXPECT_GE(front, 1);

  std::set<std::array<std::string, 3>> rows, wanted;
  for (const auto& [method, precision] : methods) {
    for (const std::string& name : cases) wanted.insert({method, precision, name});
  }
  for (const json& row : document.at("rows")) {
    const auto text = [&](const char* field) { return row.at(field).get<std::string>(); };
    rows.insert(std::array<std::string, 3>{text("method"), text("precision"), text("case")});
    EXPECT_GE(row.at("answers"), 27);
    EXPECT_EQ(row.contains("first_wrong"), row.at("wrong") > 0) << row;
    EXPECT_EQ(row.at("worst_gap").is_null(), row.at("median_gap").is_null());
    if (row.at("worst_gap").is_number()) {
      EXPECT_LE(row.at("median_gap"), row.at("worst_gap"));
    }
    for (const char* count : {"not_finite", "reflections", "flagged"}) EXPECT_LE(row.at(count), row.at("answers"));
    for (const char* error : {"worst_orthogonality", "worst_deviation"}) EXPECT_GE(row.at(error), 0);
  }
  EXPECT_EQ(rows, wanted);
  EXPECT_EQ(document.at("rows").size(), wanted.size());
}

std::set<std::pair<std::string, std::string>> methods_of_the_cpu() {
  std::set<std::pair<std::string, std::string>> methods = {{"horn", "double"}};
  for (const char* name :
       {"jacobi4", "newton", "svd", "quest", "apd", "mueller", "mueller_cold", "mcadams", "eigen_svd"}) {
    methods.insert({name, "single"});
    methods.insert({name, "double"});
  }
  return methods;
}

TEST_F(BenchRotations, TellsEveryCaseOfEveryMethodOnTheReference) {
  Outcome outcome;
  const json document = bench("--cases", outcome);
  ASSERT_EQ(outcome.status, 0) << outcome.output;
  expect_complete(document, methods_of_the_cpu());
  for (const char* words : {"worst gap", "default", "front", "seed 0", "nearly_rank_1", "is wrong in 0 of"}) {
    EXPECT_NE(outcome.output.find(words), std::string::npos) << "no '" << words << "' in:\n" << outcome.output;
  }
}

TEST_F(BenchRotations, TellsTheSameErrorsOnTheHost) {
  Outcome outcome;
  const json host = bench("--backend host --seed 3", outcome);
  ASSERT_EQ(outcome.status, 0) << outcome.output;
  expect_complete(host, methods_of_the_cpu());
  EXPECT_EQ(outcome.output.find("worst gap (wrong)"), std::string::npos) << "only with --cases";
  // A kernel answers as a loop does, to the bit, so with the same errors.
  const json reference = bench("--seed 3", outcome);
  EXPECT_EQ(host.at("rows"), reference.at("rows"));
  // Another seed, other matrices.
  EXPECT_NE(bench("--seed 4", outcome).at("rows"), reference.at("rows"));
}

TEST_F(BenchRotations, RefusesBadUsage) {
  const std::pair<const char*, const char*> cases[] = {
      {"--backend nobody", "nobody"},
      {"--backend simulated", "finding faults"},
      {"--matrices 0", "matrices"},
      {"--timed many", "timed"},
      {"--repeats 0", "repeats"},
      {"--seed -1", "seed"},
      {"--matrices 10 --json nowhere/out.json", "nowhere"},
  };
  for (const auto& [arguments, word] : cases) expect_refused("bench rotations " + std::string(arguments), {word});
}

// --- What is counted -------------------------------------------------------------------------------------------------

constexpr RotationCounts kFew = {30, 50, 3, 0};

RotationMethod method_named(const std::string& name, Precision precision) {
  for (const RotationMethod& method : cutproof::benchmarks::rotation_methods(cutproof::harness::reference_backend())) {
    if (method.name == name && method.precision == precision) return method;
  }
  throw std::out_of_range(name);
}

// The default with a fault.
using Spoil = void (*)(cutproof::fixtures::Answers& answers, const std::vector<Mat3>& a);
RotationReport report_of_spoiled(Spoil spoil) {
  RotationMethod spoiled = method_named("newton", Precision::binary32);
  spoiled.solve = [inner = spoiled.solve, spoil](const std::vector<Mat3>& a, const std::vector<Mat3>& previous,
                                                 int repeats) {
    auto timed = inner(a, previous, repeats);
    spoil(timed.answers, a);
    return timed;
  };
  return cutproof::benchmarks::measure_rotations({spoiled}, kFew, 1e9);
}

TEST(MeasureRotations, CountsEveryReflectionOfABrokenDefault) {
  const RotationReport report = report_of_spoiled([](cutproof::fixtures::Answers& answers, const std::vector<Mat3>&) {
    for (Mat3& r : answers.r) {
      for (int row = 0; row < 3; ++row) r(row, 2) = -r(row, 2);
    }
  });
  ASSERT_EQ(report.results.size(), 1U);
  const RotationResult& result = report.results.front();
  EXPECT_TRUE(result.is_default);
  EXPECT_FALSE(report.default_holds());
  EXPECT_EQ(result.all.wrong, result.all.answers);
  for (const auto& entry : result.cases) EXPECT_EQ(entry.judged.reflections, entry.judged.answers) << entry.name;
  EXPECT_FALSE(to_json(report).at("holds"));
}

TEST(MeasureRotations, CountsOneWrongAnswerAmongAll) {
  const RotationReport report = report_of_spoiled([](cutproof::fixtures::Answers& answers, const std::vector<Mat3>& a) {
    // Only the matrix that is exactly half a turn about z.
    for (std::size_t i = 0; i < a.size(); ++i) {
      if (i == 2 && a[i](2, 2) > 0 && a[i](0, 0) == -a[i](2, 2) && a[i](0, 1) == 0) answers.r[i] = Mat3{};
    }
  });
  const RotationResult& result = report.results.front();
  EXPECT_FALSE(report.default_holds());
  EXPECT_EQ(result.all.wrong, 1);
  EXPECT_EQ(result.worst_case, "half_turn_axis");
  EXPECT_NEAR(result.all.worst_gap.value_or(0), 4.0 / 3, 1e-6);
}

TEST(MeasureRotations, CountsWhatIsNoNumber) {
  const RotationReport report = report_of_spoiled([](cutproof::fixtures::Answers& answers, const std::vector<Mat3>&) {
    for (Mat3& r : answers.r) r.m[0] = std::numeric_limits<double>::quiet_NaN();
  });
  EXPECT_EQ(report.results.front().all.not_finite, report.results.front().all.answers);
  EXPECT_EQ(report.results.front().all.wrong, report.results.front().all.answers);
}

TEST(MeasureRotations, DoesNotHoldWithoutADefault) {
  const RotationReport report =
      cutproof::benchmarks::measure_rotations({method_named("svd", Precision::binary32)}, kFew, 1e9);
  EXPECT_EQ(report.results.front().all.wrong, 0);
  EXPECT_FALSE(report.default_holds());
}

// A case of all methods takes seconds: whoever asks it to stop is heard before the next method.
TEST(MeasureRotations, CanBeStoppedBeforeEachMethod) {
  const std::vector<RotationMethod> methods = {method_named("svd", Precision::binary32),
                                               method_named("newton", Precision::binary32)};
  std::vector<int64_t> begun;
  const auto stop_at_third = [&](int64_t cases_begun, const std::string&) {
    begun.push_back(cases_begun);
    if (begun.size() == 3) throw cutproof::Stopped();
  };
  EXPECT_THROW(cutproof::benchmarks::measure_rotations(methods, kFew, 1e9, stop_at_third), cutproof::Stopped);
  EXPECT_EQ(begun, (std::vector<int64_t>{1, 1, 2}));
}

TEST(RotationFront, HoldsWhatNoOtherMethodBeats) {
  const auto method = [](double gap, double seconds, int64_t not_finite = 0) {
    RotationResult result;
    result.all.worst_gap = gap;
    result.near.median = seconds;
    result.all.not_finite = not_finite;
    return result;
  };
  // Exact and slow, both middling, quick and wrong; then one that is beaten, and one whose worst gap is hidden by NaN.
  std::vector<RotationResult> results = {method(1e-9, 3), method(1e-7, 2), method(1, 1), method(1e-7, 2.5),
                                         method(0, 4, 1)};
  cutproof::benchmarks::mark_front(results);
  EXPECT_TRUE(results[0].on_front && results[1].on_front && results[2].on_front);
  EXPECT_FALSE(results[3].on_front || results[4].on_front);
  // What is exact in double does not stand in the way of what kernels can use.
  results.push_back(method(1e-15, 0.5));
  results.back().precision = Precision::binary64;
  cutproof::benchmarks::mark_front(results);
  EXPECT_TRUE(results[0].on_front && results[1].on_front && results[2].on_front && results[5].on_front);
}

TEST(RotationMethods, BesideTheDefaultAreRightWhereTheyAreSaidToBe) {
  // What docs/results/accuracy.md, Rotations, says of them; a method that stops being right there has a fault.
  constexpr int kMatrices = 2000;
  namespace fixtures = cutproof::fixtures;
  for (const char* const name : {"svd", "quest", "apd", "mueller"}) {
    for (const Precision precision : {Precision::binary32, Precision::binary64}) {
      const RotationMethod method = method_named(name, precision);
      const auto judged = [&](const fixtures::HardCase& hard) {
        return fixtures::judge(fixtures::pose(hard, kMatrices, precision), [&](const auto& a, const auto& previous) {
          return method.solve(a, previous, 0).answers;
        });
      };
      std::set<std::string> right = {"zero", "one_particle", "coincident_particles", "nan_and_inf"};
      if (method.name == "quest") right.insert("pure_rotation");
      // (Müller's method has not converged in double by then.)
      if (method.name == "apd" || (method.name == "mueller" && precision == Precision::binary32)) right.insert("near");
      for (const fixtures::HardCase& hard : fixtures::hard_cases()) {
        const fixtures::Judged result = judged(hard);
        const std::string where = method.name + ", " + hard.name + ": " + result.first_wrong;
        EXPECT_EQ(result.not_finite, 0) << where;
        EXPECT_EQ(result.reflections, 0) << where;
        if (method.name == "svd" || right.count(hard.name) > 0) {
          EXPECT_EQ(result.wrong, 0) << where;
        }
      }
    }
  }
}

// So a body at rest would stay where it is.
TEST(RotationMethods, KeepTheIdentityToTheBitForASymmetricMatrix) {
  std::mt19937_64 random(6);
  std::normal_distribution<float> normal;
  std::vector<Mat3> a(200);
  for (Mat3& matrix : a) {
    std::array<float, 9> b;
    for (float& entry : b) entry = normal(random);
    for (std::size_t row = 0; row < 3; ++row) {
      for (std::size_t k = 0; k <= row; ++k) {
        const float product = b[3 * row] * b[3 * k] + b[3 * row + 1] * b[3 * k + 1] + b[3 * row + 2] * b[3 * k + 2];
        matrix.m[3 * row + k] = matrix.m[3 * k + row] = product;
      }
    }
  }
  const std::vector<Mat3> identities(a.size());
  for (const char* const name : {"newton", "jacobi4", "apd", "mueller"}) {
    EXPECT_EQ(method_named(name, Precision::binary32).solve(a, identities, 0).answers.r, identities) << name;
  }
}

TEST(RotationMethods, HaveOneDefaultAndReadAndWriteWhatTheySay) {
  int defaults = 0;
  for (const RotationMethod& method :
       cutproof::benchmarks::rotation_methods(cutproof::harness::described_backend("host"))) {
    defaults += method.is_default;
    EXPECT_EQ(method.is_default, method.name == "newton" && method.precision == Precision::binary32) << method.name;
    EXPECT_EQ(method.bytes, method.precision == Precision::binary32 ? 109 : 217);
  }
  EXPECT_EQ(defaults, 1);
}

}  // namespace
}  // namespace rotations_test
