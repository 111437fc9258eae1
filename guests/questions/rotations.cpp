// Rotations of clusters: the hard cases of docs/design/method.md, each matrix judged by itself against the best
// rotation in extended precision.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <optional>
#include <unordered_map>

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
      // A matrix related to another answer has its own best rotation.
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

// Of ordinary clusters, over and over again: what is asked is whether each of very many is answered. An odd number of
// them, so that what lies a power of two away is another one.
constexpr int64_t kLargeMatrices = 251;
constexpr const char* kLargeRotations = "very many matrices of clusters";
// Beside 2¹⁶. The least ones show how the time of an answer grows.
constexpr int64_t kRotationSizes[] = {4'097, 16'385, 65'535, 65'536, 65'537};

std::vector<std::string> large_kinds_of_rotations() { return {kLargeRotations}; }

Question draw_large_rotations(uint64_t seed, int64_t kind, int64_t size, Precision precision) {
  const fixtures::Frame frame = fixtures::draw_ordinary(kLargeMatrices, precision, 0.3, large_seed(seed, kind));
  std::vector<double> a, previous;
  for (int64_t row = 0; row < size; ++row) {
    append(a, frame.a[at(row % kLargeMatrices)]);
    append(previous, frame.previous[at(row % kLargeMatrices)]);
  }
  return {kLargeRotations,
          {make_array("a", {size, 9}, a), make_array("previous", {size, 9}, previous)},
          {make_array("expected", {size}, std::vector<uint8_t>(at(size), 0))},
          size};
}

int64_t count_matrices(const Question& question) { return question.given[0].rows(); }

std::string size_of_rotations(const Question& question) {
  return fmt::format("{} matri{}", count_matrices(question), count_matrices(question) == 1 ? "x" : "ces");
}

Mat3 inverse_of(const Mat3& m) {
  const double determinant = fixtures::determinant(m);
  Mat3 inverse;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      const int i = (column + 1) % 3, ii = (column + 2) % 3, j = (row + 1) % 3, jj = (row + 2) % 3;
      inverse(row, column) = (m(i, j) * m(ii, jj) - m(i, jj) * m(ii, j)) / determinant;
    }
  }
  return inverse;
}

// One matrix, its answer, and the best rotation as far as known.
struct Answered {
  Mat3 a, previous, r;
  std::optional<Mat3> best;
};

// Names of what the answer is instead of the best rotation; "" if it is nothing that has one. It must lie ten times as
// near to it as to the best one, and as near as a ten-thousandth.
std::string mistaken_for(const Answered& it) {
  std::vector<std::string> names;
  const auto see = [&](const char* name, const Mat3& other) {
    const double off = fixtures::distance(it.r, other),
                 size = fixtures::distance(other, Mat3{{0, 0, 0, 0, 0, 0, 0, 0, 0}});
    const bool apart = !it.best || fixtures::distance(other, *it.best) > 10 * off;
    if (std::isfinite(off) && off <= 1e-4 * size && apart) names.emplace_back(name);
  };
  if (it.best) see("the transpose of the best rotation", transposed(*it.best));
  see("the matrix itself", it.a);
  see("the inverse of the matrix", inverse_of(it.a));
  see("the transpose of the matrix", transposed(it.a));
  see("the previous rotation", it.previous);
  see("the identity", Mat3{});
  return names.empty() ? "" : fmt::format(". R is {}", fmt::join(names, ", and "));
}

std::string nine_numbers(const Mat3& m, Precision precision) {
  std::string text;
  for (std::size_t k = 0; k < 9; ++k) {
    const double entry = m.m[k] + 0.0;  // no -0
    text += k == 0 ? "[" : k % 3 == 0 ? "; " : " ";
    text += precision == Precision::binary32 ? fmt::format("{}", static_cast<float>(entry)) : fmt::format("{}", entry);
  }
  return text + "]";
}

// Everything about it that a person needs to see it.
std::string shown(const Answered& it, bool previous_matters, Precision precision) {
  std::string text = fmt::format("A = {}, R = {}", nine_numbers(it.a, precision), nine_numbers(it.r, precision));
  if (previous_matters) text += ", previous = " + nine_numbers(it.previous, precision);
  if (it.best) {
    Mat3 best = *it.best;
    for (double& entry : best.m) entry = std::abs(entry) < 1e-9 ? 0 : static_cast<float>(entry);
    text += ", best R = " + nine_numbers(best, Precision::binary32);
  }
  return text + mistaken_for(it);
}

// How far one answer is off, by property; nothing where the property is not asked of it.
struct Off {
  std::optional<double> rotation, best, nearest, kept;
};

Off off_by(const Mat3& a, const Mat3& previous, const Mat3& r, uint8_t expected,
           const fixtures::RotationBounds& bounds) {
  Off off;
  if (expected == 2) {
    off.kept = r == previous ? 0 : 1;
    const bool all_zero = std::all_of(a.m.begin(), a.m.end(), [](double entry) { return entry == 0; });
    if (!all_zero) return off;  // NaN, or what is left of it
  }
  const double orthogonality = fixtures::orthogonality(r);
  const bool reflection = orthogonality <= bounds.orthogonality && !(fixtures::determinant(r) > 0);
  off.rotation = reflection ? 2 : orthogonality;
  if (expected == 2 || !std::isfinite(orthogonality)) return off;
  const oracles::BestRotation best = oracles::best_rotation(a);
  off.best = oracles::objective_gap(best, r);
  if (expected == 1) {
    const oracles::NearestRotation wanted = oracles::nearest_of_rank_one(best, previous);
    off.nearest = wanted.weight * fixtures::distance(r, wanted.r);
  }
  return off;
}

// Results of one property, and its worst answer.
struct Finding {
  Finding(std::string_view property, std::string_view source, double bound) {
    verdict.property = property;
    verdict.bound_source = source;
    verdict.bound = bound;
    verdict.unit = "1";
  }
  void see(int64_t row, const std::optional<double>& measured) {
    if (!measured) return;
    ++verdict.checked;
    if (!(*measured <= verdict.bound)) {
      verdict.holds = false;
      verdict.witness.particles.push_back(static_cast<int32_t>(row));
    }
    if (std::isnan(verdict.measured) || *measured <= verdict.measured) return;
    verdict.measured = *measured;
    worst = row;
  }
  Verdict verdict;
  int64_t worst = 0;
};

std::vector<Verdict> judge_rotations(const Question& question, const Arrays& answers, Precision precision) {
  const Array &a = question.given[0], &previous = question.given[1], &r = answers[0];
  const auto expected = question.known[0].of<uint8_t>();
  const fixtures::RotationBounds bounds = fixtures::rotation_bounds(precision);
  const char* const source = "method.md, Hard cases";
  Finding rotation("rotation", source, bounds.orthogonality), best("best rotation", source, bounds.gap),
      nearest("nearest rotation", source, bounds.deviation), kept("previous rotation kept", source, 0);
  // Repeated parts of a large question are judged once: bytes of all inputs of the judgement.
  std::unordered_map<std::string, Off> known;
  for (int64_t row = 0; row < a.rows(); ++row) {
    const std::array<Mat3, 3> numbers = {matrix(a, row), matrix(previous, row), matrix(r, row)};
    const auto judged = [&] { return off_by(numbers[0], numbers[1], numbers[2], expected[at(row)], bounds); };
    Off off;
    if (question.size == 0) {
      off = judged();
    } else {
      std::string key(sizeof numbers + 1, static_cast<char>(expected[at(row)]));
      std::memcpy(key.data(), numbers.data(), sizeof numbers);
      const auto [entry, is_new] = known.try_emplace(std::move(key));
      if (is_new) entry->second = judged();
      off = entry->second;
    }
    rotation.see(row, off.rotation);
    best.see(row, off.best);
    nearest.see(row, off.nearest);
    kept.see(row, off.kept);
  }
  std::vector<Verdict> verdicts;
  for (Finding* const found : {&rotation, &best, &nearest, &kept}) {
    Verdict& verdict = verdicts.emplace_back(std::move(found->verdict));
    if (verdict.checked == 0) verdict.vacuous = "no such matrix in this case";
    if (verdict.holds) continue;
    Answered it{matrix(a, found->worst), matrix(previous, found->worst), matrix(r, found->worst), {}};
    const uint8_t what = expected[at(found->worst)];
    if (what != 2) it.best = reference::closest_rotation(it.a, it.previous).r;
    const double measured = verdict.measured;
    const std::string wrong = found == &kept      ? "the rotation is undetermined, and it is not the previous one"
                              : found == &nearest ? fmt::format("{:.2g} from the nearest one to the previous", measured)
                              : found == &best    ? fmt::format("tr(RᵀA) is {:.2g} of Σσ below the best", measured)
                              : fixtures::orthogonality(it.r) <= bounds.orthogonality
                                  ? std::string("a reflection")
                                  : fmt::format("‖RᵀR - I‖ = {:.2g} (NaN: not finite, or not written)", measured);
    verdict.witness.text = fmt::format("{} of {} wrong; matrix {}: {}. {}", verdict.witness.particles.size(),
                                       verdict.checked, found->worst, wrong, shown(it, what != 0, precision));
  }
  return verdicts;
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
      return fmt::format("the expectation of matrix {} is impossible", row);
    }
  }
  return "";
}

// How much a number takes to read.
double complexity(double x) {
  if (x == 0) return 0;
  if (!std::isfinite(x)) return 1000;
  int exponent = 0, bits = 0;
  for (double rest = std::frexp(std::abs(x), &exponent); rest != 0; ++bits) {
    rest *= 2;
    rest -= std::floor(rest);
  }
  return 1 + bits + std::min(std::abs(exponent - 1), 100) + (x < 0 ? 0.5 : 0);
}
double complexity(const Mat3& m) {
  double sum = 0;
  for (const double entry : m.m) sum += complexity(entry);
  return sum;
}

// Nearest number with so many bits.
double with_bits(double x, int bits) {
  int exponent = 0;
  const double part = std::frexp(x, &exponent);
  return std::ldexp(std::round(std::ldexp(part, bits)), exponent - bits);
}

// Sign of the determinant; 0 where the matrix is nearly singular, or not finite.
int orientation(Mat3 m) {
  double greatest = 0;
  for (const double entry : m.m) {
    if (!std::isfinite(entry)) return 0;
    greatest = std::max(greatest, std::abs(entry));
  }
  if (greatest == 0) return 0;
  for (double& entry : m.m) entry = std::ldexp(entry, -std::ilogb(greatest));
  const double determinant = fixtures::determinant(m);
  return std::abs(determinant) < 1e-6 ? 0 : determinant > 0 ? 1 : -1;
}

// Matrices that are simpler to read, the most drastic first: well-known ones, all of it by a power of two, one number
// after the other. Their orientation is the same, or another fault may take the place of the first: what reflects may
// also fail of what is singular.
std::vector<Mat3> simpler_matrices(const Mat3& m) {
  std::vector<Mat3> simpler;
  const auto add = [&](const Mat3& other) {
    if (complexity(other) < complexity(m) && orientation(other) == orientation(m)) simpler.push_back(other);
  };
  for (const Mat3& plain :
       {Mat3{}, Mat3{{1, 0, 0, 0, 1, 0, 0, 0, 0}}, Mat3{{1, 0, 0, 0, 0, 0, 0, 0, 0}},
        Mat3{{1, 0, 0, 0, 1, 0, 0, 0, -1}}, Mat3{{0, -1, 0, 1, 0, 0, 0, 0, 1}}, Mat3{{0, 0, 1, 1, 0, 0, 0, 1, 0}},
        Mat3{{2, 0, 0, 0, 1, 0, 0, 0, 1}}, Mat3{{1, 1, 0, 0, 1, 0, 0, 0, 1}}, Mat3{{1, -2, 0, 2, 1, 0, 0, 0, 1}},
        Mat3{{0, -2, 0, 2, 0, 0, 0, 0, -1}}, Mat3{{0, -1, 0, 1, 0, 0, 0, 0, 0}}, Mat3{{0, 0, 0, 1, 0, 0, 0, 0, 0}},
        Mat3{{1, 2, 0, 0, 1, 3, 0, 0, 1}}}) {
    add(plain);
  }
  double greatest = 0;
  for (const double entry : m.m) greatest = std::max(greatest, std::abs(entry));
  if (!std::isfinite(greatest) || greatest == 0) return simpler;
  Mat3 scaled = m;
  const int exponent = std::ilogb(greatest);
  for (double& entry : scaled.m) entry = std::ldexp(entry, -exponent);
  if (exponent != 0) add(scaled);
  for (std::size_t k = 0; k < 9; ++k) {
    for (const double value : {0.0, 1.0, -1.0, std::round(m.m[k]), with_bits(m.m[k], 1), with_bits(m.m[k], 2),
                               with_bits(m.m[k], 4), with_bits(m.m[k], 8), with_bits(m.m[k], 16)}) {
      if (!(complexity(value) < complexity(m.m[k]))) continue;
      Mat3 other = m;
      other.m[k] = value;
      add(other);
    }
  }
  return simpler;
}

// Half of the matrices; of a single one, one with simpler numbers. What is expected of a matrix is known without
// looking at it only where it is the best rotation, so that is what is expected then.
std::vector<Question> simpler_rotations(const Question& question) {
  const int64_t rows = count_matrices(question);
  std::vector<Question> simpler;
  for (const auto& [first, end] : {std::pair{int64_t{0}, rows / 2}, std::pair{rows / 2, rows}}) {
    if (rows <= 1) break;
    Question half{question.kind, {}, {}};
    for (const Array& array : question.given) half.given.push_back(rows_of(array, first, end));
    for (const Array& array : question.known) half.known.push_back(rows_of(array, first, end));
    simpler.push_back(std::move(half));
  }
  if (rows != 1) return simpler;
  const Mat3 a = matrix(question.given[0], 0), previous = matrix(question.given[1], 0);
  const uint8_t expected = question.known[0].of<uint8_t>()[0];
  const auto add = [&](const Mat3& one, const Mat3& before, uint8_t what) {
    const auto numbers = [](const Mat3& m) { return std::vector<double>(m.m.begin(), m.m.end()); };
    simpler.push_back({question.kind,
                       {make_array("a", {1, 9}, numbers(one)), make_array("previous", {1, 9}, numbers(before))},
                       {make_array("expected", {1}, std::vector<uint8_t>{what})}});
  };
  for (const Mat3& one : simpler_matrices(a)) {
    if (complexity(one) > 0) add(one, previous, 0);  // of zeros none is the best
  }
  // Rotations without rounding.
  for (const Mat3& before : {Mat3{}, Mat3{{0, -1, 0, 1, 0, 0, 0, 0, 1}}}) {
    if (complexity(before) < complexity(previous)) add(a, before, expected);
  }
  // Along one axis there is one best turn that is nearest to the previous rotation.
  const Mat3 along_x{{1, 0, 0, 0, 0, 0, 0, 0, 0}};
  if (expected == 1 && complexity(along_x) < complexity(a)) add(along_x, previous, 1);
  const Mat3 nothing{{0, 0, 0, 0, 0, 0, 0, 0, 0}};
  if (expected == 2 && complexity(nothing) < complexity(a)) add(nothing, previous, 2);
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
    .is_batch = true,
    .draw = draw_rotations,
    .cases_of = count_matrices,
    .size_of = size_of_rotations,
    .judge = judge_rotations,
    .problem = problem_of_rotations,
    .simpler = simpler_rotations,
    .kinds = kinds_of_rotations,
    .large_kinds = large_kinds_of_rotations,
    .sizes = kRotationSizes,
    .draw_large = draw_large_rotations,
};

}  // namespace cutproof::guests
