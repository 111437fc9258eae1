#include "cli/results.h"

#include "cli/commands.h"
#include "model/io/json_number.h"
#include "model/io/verdict_json.h"
#include "model/stage.h"

namespace cutproof::cli {

namespace {

nlohmann::json to_json(const harness::FrameResult& frame, bool timed) {
  nlohmann::json stages = nlohmann::json::array();
  nlohmann::json seconds = nlohmann::json::object();
  for (const Stage stage : kStages) {
    const auto index = static_cast<std::size_t>(stage);
    if (!frame.ran[index]) continue;
    stages.push_back(name_of(stage));
    if (timed && frame.seconds[index] > 0) seconds[std::string(name_of(stage))] = frame.seconds[index];
  }
  nlohmann::json result = {{"frame", frame.frame},        {"stages", stages},         {"removed", frame.removed},
                           {"debris", frame.debris},      {"particles", frame.alive}, {"clusters", frame.clusters},
                           {"triangles", frame.triangles}};
  if (timed) {
    result["seconds"] = seconds;
    result["total_seconds"] = frame.total_seconds;
  }
  return result;
}

}  // namespace

nlohmann::json to_json(const RunResult& result, const harness::SceneJudge* judge) {
  nlohmann::json document = {{"format", "cutproof." + result.command},
                             {"format_version", 2},
                             {"cutproof", kVersion},
                             {"source", result.source},
                             {"scene", result.scene.name},
                             {"backend", result.backend},
                             {"seed", result.scene.seed},
                             {"body",
                              {{"name", result.body.name},
                               {"spacing", result.body.grid.spacing},
                               {"particles", result.body.particle_count()},
                               {"clusters", result.clusters_at_start}}}};
  document["frames"] = nlohmann::json::array();
  const bool timed = result.command == "run";
  for (const harness::FrameResult& frame : result.frames) document["frames"].push_back(to_json(frame, timed));
  document["checked"] = judge != nullptr;
  if (judge != nullptr) {
    document["verdicts"] = nlohmann::json::array();
    int64_t failed = 0, expected = 0;
    for (const Verdict& verdict : judge->verdicts()) {
      const bool foreseen = judge->is_expected_failure(verdict);
      document["verdicts"].push_back(io::verdict_json(verdict, foreseen));
      if (!verdict.holds) ++(foreseen ? expected : failed);
    }
    document["summary"] = {{"holds", judge->holds()},
                           {"verdicts", judge->verdicts().size()},
                           {"failed", failed},
                           {"failed_as_expected", expected}};
    document["properties"] = judge->summaries().to_json();
    document["notes"] = judge->notes();
    document["not_reached"] = judge->not_reached();
    document["left_to_reference"] = {{"stages", judge->left_to_reference()}, {"expected", judge->not_its_own()}};
  }
  return document;
}

}  // namespace cutproof::cli
