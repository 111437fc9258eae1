#include "tuning/trial.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "model/io/json_number.h"
#include "model/rules.h"

namespace cutproof::tuning {

using nlohmann::json;

std::string differences(const Configuration& configuration, const Configuration& given) {
  const Scene &scene = configuration.scene, &before = given.scene;
  std::vector<std::string> found;
  const auto note = [&](bool differs, const std::string& text) {
    if (differs) found.push_back(text);
  };
  const ClusterSpec &clusters = scene.clusters, &old = before.clusters;
  note(clusters.side != old.side, fmt::format("clusters.side {}", clusters.side));
  note(clusters.spacing != old.spacing, fmt::format("clusters.spacing {:g}", clusters.spacing));
  note(clusters.radius != old.radius, fmt::format("clusters.radius {:g}", clusters.radius));
  note(scene.detect.criterion != before.detect.criterion, "no detection");
  note(scene.split.debris != before.split.debris, fmt::format("debris {}", scene.split.debris));
  note(scene.skin.wanted != before.skin.wanted, "no skin");
  return fmt::format("{}", fmt::join(found, ", "));
}

json to_json(const Trial& trial, const Configuration& given) {
  const Scene& scene = trial.configuration.scene;
  json rms = json::array();
  for (const double value : trial.rms_h) rms.push_back(json_number(value));
  return {{"substeps", scene.step.substeps},
          {"iterations", scene.step.iterations},
          {"acceleration", name_of(scene.step.acceleration)},
          {"differences", differences(trial.configuration, given)},
          {"outcome", name_of(trial.outcome)},
          {"why", trial.why},
          {"rms_h", json_number(trial.greatest_rms_h)},
          {"max_h", json_number(trial.greatest_h)},
          {"rms_h_by_frame", rms},
          {"removed_otherwise", trial.removed_otherwise},
          {"seconds_per_frame", benchmarks::to_json(trial.frame)},
          {"timed_runs", trial.frame.count}};
}

}  // namespace cutproof::tuning
