// Rotations of clusters: the hard cases of docs/design/method.md, each matrix judged by itself against the best
// rotation in extended precision.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "fixtures/hard_matrices.h"
#include "fixtures/rotation_answers.h"
#include "guests/questions/kinds.h"
#include "model/at.h"
#include "reference_cpu/reference.h"

namespace cutproof::guests {

namespace {

// Of one question.
constexpr int64_t kMatrices = 256;

Mat3 matrix(const Array& array, int64_t row) {
  Mat3 m;
  for (std::size_t k = 0; k < 9; ++k) m.m[k] = array.number(9 * row + static_cast<int64_t>(k));
  return m;
}

void append(std::vector<double>& values, const Mat3& m) { values.insert(values.end(), m.m.begin(), m.m.end()); }

Mat3 rounded(Mat3 m, Precision precision) {
  if (precision == Precision::binary32) {
    for (double& entry : m.m) entry = static_cast<float>(entry);
  }
  return m;
}

Question draw_rotations(uint64_t seed, int64_t index, Precision precision) {
  const auto& hard = fixtures::hard_cases();
  const fixtures::HardCase& of = hard[at(index) % hard.size()];
  const std::vector<fixtures::Frame> frames = fixtures::draw(of, kMatrices, precision, mixed(seed, index));
  // Frames one below the other, as many problems of each as make up the question. Where a frame begins with the answers
  // of the one before, it gets what the reference answers there.
  const auto count = std::max<std::size_t>(1, kMatrices / frames.size());
  std::vector<double> a, previous;
  std::vector<uint8_t> expected;
  std::vector<Mat3> before(count);
  for (const fixtures::Frame& frame : frames) {
    for (std::size_t i = 0; i < count; ++i) {
      const Mat3 start = frame.previous.empty() ? before[i] : frame.previous[i];
      append(a, frame.a[i]);
      append(previous, start);
      // What is related to another answer has a best rotation of its own.
      const bool best = frame.expected == fixtures::Expected::best || frame.expected == fixtures::Expected::related;
      expected.push_back(best ? 0 : frame.expected == fixtures::Expected::nearest ? 1 : 2);
      before[i] = rounded(reference::closest_rotation(frame.a[i], start).r, precision);
    }
  }
  const auto rows = static_cast<int64_t>(expected.size());
  return {of.name + ": " + of.what,
          {make_array("a", {rows, 9}, a), make_array("previous", {rows, 9}, previous)},
          {make_array("expected", {rows}, expected)}};
}

int64_t count_matrices(const Question& question) { return question.given[0].rows(); }

std::string size_of_rotations(const Question& question) {
  return fmt::format("{} matri{}", count_matrices(question), count_matrices(question) == 1 ? "x" : "ces");
}

// The worst of what was found of one property.
struct Finding {
  explicit Finding(std::string_view property, std::string_view source, double bound) {
    verdict.property = property;
    verdict.bound_source = source;
    verdict.bound = bound;
    verdict.unit = "1";
  }
  void see(int64_t row, double measured, const std::string& what) {
    ++verdict.checked;
    const bool fails = !(measured <= verdict.bound);
    wrong += fails ? 1 : 0;
    if (fails && verdict.holds) {
      verdict.holds = false;
      first = fmt::format("matrix {}: {}", row, what);
      verdict.witness.particles = {static_cast<int32_t>(row)};
    }
    if (std::isnan(verdict.measured) || measured <= verdict.measured) return;
    verdict.measured = measured;
  }
  Verdict take() {
    if (!verdict.holds) verdict.witness.text = fmt::format("{} of {} wrong; {}", wrong, verdict.checked, first);
    if (verdict.checked == 0) verdict.vacuous = "no such matrix in this case";
    return std::move(verdict);
  }
  Verdict verdict;
  int64_t wrong = 0;
  std::string first;
};

std::vector<Verdict> judge_rotations(const Question& question, const Arrays& answers, Precision precision) {
  const Array &a = question.given[0], &previous = question.given[1], &r = answers[0];
  const auto expected = question.known[0].of<uint8_t>();
  const fixtures::RotationBounds bounds = fixtures::rotation_bounds(precision);
  const char* const source = "method.md, Hard cases";
  Finding rotation("rotation", source, bounds.orthogonality), best("best rotation", source, bounds.gap),
      nearest("nearest rotation", source, bounds.deviation), kept("previous rotation kept", source, 0);
  for (int64_t row = 0; row < a.rows(); ++row) {
    const Mat3 answer = matrix(r, row), from = matrix(a, row), before = matrix(previous, row);
    const uint8_t what = expected[at(row)];
    if (what == 2) {
      kept.see(row, answer == before ? 0 : 1, "nothing is known of the rotation, and it is not the previous one");
      const bool all_zero = std::all_of(from.m.begin(), from.m.end(), [](double entry) { return entry == 0; });
      if (!all_zero) continue;  // NaN, or what is left of it
    }
    const double off = fixtures::orthogonality(answer);
    const bool reflection = off <= bounds.orthogonality && !(fixtures::determinant(answer) > 0);
    rotation.see(
        row, reflection ? 2 : off,
        reflection ? "a reflection" : fmt::format("‖RᵀR - I‖ = {:.2g} (NaN: not finite, or not written)", off));
    if (what == 2 || !std::isfinite(off)) continue;
    const oracles::BestRotation known = oracles::best_rotation(from);
    const double gap = oracles::objective_gap(known, answer);
    best.see(row, gap, fmt::format("tr(RᵀA) is {:.2g} of Σσ below the best", gap));
    if (what == 1) {
      const oracles::NearestRotation wanted = oracles::nearest_of_rank_one(known, before);
      const double deviation = wanted.weight * fixtures::distance(answer, wanted.r);
      nearest.see(row, deviation, fmt::format("{:.2g} from the nearest one to the previous", deviation));
    }
  }
  return {rotation.take(), best.take(), nearest.take(), kept.take()};
}

std::string problem_of_rotations(const Question& question) {
  const int64_t rows = count_matrices(question);
  if (question.given[1].rows() != rows || question.known[0].rows() != rows) return "its arrays are not of equal length";
  const auto expected = question.known[0].of<uint8_t>();
  for (int64_t row = 0; row < rows; ++row) {
    const Mat3 a = matrix(question.given[0], row);
    const bool known = std::all_of(a.m.begin(), a.m.end(), [](double entry) { return std::isfinite(entry); }) &&
                       std::any_of(a.m.begin(), a.m.end(), [](double entry) { return entry != 0; });
    if (expected[at(row)] > 2 || (expected[at(row)] != 2 && !known)) {
      return fmt::format("what is expected of matrix {} is not what can be", row);
    }
  }
  return "";
}

std::vector<Question> simpler_rotations(const Question& question) {
  const int64_t rows = count_matrices(question);
  std::vector<Question> simpler;
  if (rows <= 1) return simpler;
  for (const auto& [first, end] : {std::pair{int64_t{0}, rows / 2}, std::pair{rows / 2, rows}}) {
    Question half{question.kind, {}, {}};
    for (const Array& array : question.given) half.given.push_back(rows_of(array, first, end));
    for (const Array& array : question.known) half.known.push_back(rows_of(array, first, end));
    simpler.push_back(std::move(half));
  }
  return simpler;
}

std::vector<std::string> kinds_of_rotations() {
  std::vector<std::string> kinds;
  for (const fixtures::HardCase& hard : fixtures::hard_cases()) kinds.push_back(hard.name + ": " + hard.what);
  return kinds;
}

constexpr AnswerArray kRotationAnswers[] = {
    {.name = "r", .real = true, .columns = 9, .rows_of = "a", .text = "the rotations, row by row"}};

}  // namespace

const OperationDescription kRotations = {
    .number = wire::rotations,
    .name = "rotations",
    .text = "the rotation R with the greatest tr(RᵀA) for each matrix A",
    .by_itself = "rotations best",
    .answers = kRotationAnswers,
    .cases = "matrices",
    .draw = draw_rotations,
    .cases_of = count_matrices,
    .size_of = size_of_rotations,
    .judge = judge_rotations,
    .problem = problem_of_rotations,
    .simpler = simpler_rotations,
    .kinds = kinds_of_rotations,
};

}  // namespace cutproof::guests
