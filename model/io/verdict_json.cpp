#include "model/io/verdict_json.h"

#include <fmt/format.h>

#include "model/io/json_number.h"
#include "model/stage.h"

namespace cutproof::io {

nlohmann::json verdict_json(const Verdict& verdict, bool expected_failure) {
  nlohmann::json result = {{"property", verdict.property},
                           {"stage", name_of(verdict.stage)},
                           {"backend", verdict.backend},
                           {"frame", verdict.frame},
                           {"body", verdict.body},
                           {"holds", verdict.holds},
                           {"measured", json_number(verdict.measured)},
                           {"bound", json_number(verdict.bound)},
                           {"unit", verdict.unit},
                           {"bound_source", verdict.bound_source},
                           {"checked", verdict.checked}};
  if (!verdict.vacuous.empty()) result["nothing_judged"] = verdict.vacuous;
  if (verdict.inconclusive > 0) result["inconclusive"] = verdict.inconclusive;
  if (expected_failure && !verdict.holds) result["expected_failure"] = true;
  if (!verdict.holds) {
    result["witness"] = {{"text", verdict.witness.text},
                         {"clusters", verdict.witness.clusters},
                         {"particles", verdict.witness.particles},
                         {"path", verdict.witness.path},
                         {"triangles", verdict.witness.triangles}};
    if (!verdict.witness.frames.empty()) result["witness"]["frames"] = verdict.witness.frames;
  }
  return result;
}

nlohmann::json verdicts_json(const std::vector<Verdict>& verdicts, bool in_stages) {
  // A list that push_back makes of null is broken where there is no memory for it (nlohmann::json 3.11).
  nlohmann::json list = nlohmann::json::array();
  for (const Verdict& verdict : verdicts) {
    list.push_back(verdict_json(verdict, false));
    if (!in_stages) list.back()["stage"] = nullptr;
  }
  return list;
}

std::string in_unit(const std::string& figure, const std::string& unit) {
  return unit == "1" || unit.empty() ? figure : figure + " " + unit;
}

std::string share_of(double of_bound) {
  const std::string rounded = fmt::format("{:.2g}", of_bound);
  if (rounded != "1" || of_bound == 1) return rounded;
  return of_bound < 1 ? "0.99" : "1.01";
}

std::string verdict_text(const Verdict& verdict) {
  return fmt::format("'{}' fails after {} in frame {} on backend '{}': {}", verdict.property, name_of(verdict.stage),
                     verdict.frame, verdict.backend, measured_text(verdict));
}

std::string measured_text(const Verdict& verdict) {
  if (!was_judged(verdict)) return verdict.witness.text;
  return fmt::format("measured {}, bound {} ({}). {}", in_unit(fmt::format("{:g}", verdict.measured), verdict.unit),
                     in_unit(fmt::format("{:g}", verdict.bound), verdict.unit), verdict.bound_source,
                     verdict.witness.text);
}

}  // namespace cutproof::io
