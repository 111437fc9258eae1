#include "guests/questions/vectors.h"

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>

#include "guests/questions/dissected.h"
#include "model/at.h"
#include "model/io/json_number.h"

namespace cutproof::guests {

std::span<const OperationDescription> vector_operations() {
  static const std::array all = {kRotations, kComponents, kSurface, kClusters, kSplit, kMerge};
  return all;
}

const OperationDescription* find_vector_operation(std::string_view name) {
  for (const OperationDescription& each : vector_operations()) {
    if (each.name == name) return &each;
  }
  return nullptr;
}

int64_t usual_vector_cases(const OperationDescription& operation) {
  // A case of rotations is some hundred matrices.
  return operation.number == wire::rotations ? 1 : 200;
}

Vectors draw_vectors(const OperationDescription& operation, uint64_t seed, int64_t cases, Precision precision) {
  Vectors vectors;
  vectors.operation = &operation;
  vectors.precision = precision;
  vectors.seed = seed;
  vectors.kinds = operation.kinds();
  const auto kinds = static_cast<int64_t>(vectors.kinds.size());
  for (int64_t index = 0; index < std::min(std::max(cases, kinds), kMostCases); ++index) {
    Question question = operation.draw(seed, index, precision);
    for (Array& array : question.given) {
      if (array.type != ElementType::f64 || array.name == "spacing" || precision == Precision::binary64) continue;
      // As if it had been read from a file of that precision.
      std::vector<double> values;
      for (const double value : array.of<double>()) values.push_back(static_cast<float>(value));
      array = make_array(array.name, array.shape, values);
    }
    vectors.kind.push_back(static_cast<int32_t>(index % kinds));
    vectors.cases.push_back(std::move(question));
  }
  return vectors;
}

harness::Promises promises_of(const OperationDescription& operation, const std::optional<std::string>& words) {
  harness::Promises promises;
  promises.words = harness::parse_promises(words.value_or(std::string(operation.by_itself)), "--promises", "");
  return promises;
}

VectorReport judge_vectors(const Vectors& vectors, const AllAnswers& answers, const harness::Promises& promises) {
  const OperationDescription& operation = *vectors.operation;
  VectorReport report;
  report.operation = &operation;
  report.cases = static_cast<int64_t>(vectors.cases.size());
  for (std::size_t index = 0; index < vectors.cases.size(); ++index) {
    bool fails = false;
    for (Verdict& verdict : operation.judge(vectors.cases[index], answers[index], vectors.precision)) {
      if (!promises.cover(verdict.property)) {
        const auto known = std::find_if(report.not_judged.begin(), report.not_judged.end(),
                                        [&](const NotJudged& n) { return n.property == verdict.property; });
        NotJudged& entry = known != report.not_judged.end()
                               ? *known
                               : report.not_judged.emplace_back(NotJudged{verdict.property, "not promised", 0});
        entry.failing += verdict.holds ? 0 : 1;
        continue;
      }
      report.properties.add(verdict);
      report.verdicts += verdict.checked > 0 || !verdict.holds ? 1 : 0;
      if (verdict.holds) continue;
      fails = true;
      report.failures.push_back({static_cast<int64_t>(index), std::move(verdict)});
    }
    report.failed += fails ? 1 : 0;
  }
  for (std::size_t k = 0; k < operation.answers.size() && !answers.empty(); ++k) {
    const AnswerArray& wanted = operation.answers[k];
    if (!wanted.optional || !answers.front()[k].name.empty()) continue;
    report.not_judged.push_back({std::string(wanted.name), "it is not among the answers", 0});
  }
  return report;
}

int64_t first_row(const Vectors& vectors, int64_t index) {
  const bool of_matrices = vectors.operation->number == wire::rotations;
  int64_t row = 0;
  for (int64_t k = 0; k < index; ++k) {
    row += find_array(vectors.cases[at(k)].given, of_matrices ? "a" : "alive")->rows();
  }
  return row;
}

nlohmann::json to_json(const Vectors& vectors, const VectorReport& report) {
  using nlohmann::json;
  json failures = json::array(), not_judged = json::array();
  for (const VectorFailure& failure : report.failures) {
    const Verdict& verdict = failure.verdict;
    failures.push_back({{"property", verdict.property},
                        {"case", failure.index},
                        {"kind", vectors.cases[at(failure.index)].kind},
                        {"first_row", first_row(vectors, failure.index)},
                        {"measured", json_number(verdict.measured)},
                        {"bound", json_number(verdict.bound)},
                        {"text", verdict.witness.text},
                        {"clusters", verdict.witness.clusters},
                        {"particles", verdict.witness.particles}});
  }
  for (const NotJudged& each : report.not_judged) {
    not_judged.push_back({{"property", each.property}, {"why", each.why}, {"failing", each.failing}});
  }
  return {{"operation", report.operation->name},
          {"precision", vectors.precision == Precision::binary32 ? "single" : "double"},
          {"seed", vectors.seed},
          {"cases", report.cases},
          {"properties", report.properties.to_json(false)},
          {"not_judged", std::move(not_judged)},
          {"failures", std::move(failures)},
          {"summary",
           {{"holds", report.holds()},
            {"verdicts", report.verdicts},
            {"failed", report.failures.size()},
            {"failed_cases", report.failed}}}};
}

}  // namespace cutproof::guests
