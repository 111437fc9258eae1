#include "property_tests/shown_case.h"

#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <optional>
#include <variant>
#include <vector>

#include "model/counted.h"
#include "model/error.h"
#include "model/rules.h"
#include "property_tests/dissection.h"

namespace cutproof::property_tests {

ShownCase run_to_show(const std::function<std::unique_ptr<Backend>()>& make, const Case& c) {
  const std::unique_ptr<Backend> backend = make();
  ShownCase shown;
  try {
    std::vector<Instance> loaded = {instance_of(c)};
    std::vector<CaseRun> runs = run_cases(*backend, loaded);
    shown.trace = std::move(runs.front().trace);
    shown.loaded = std::move(loaded.front());
  } catch (const MachineError&) {
    throw;
  } catch (const std::exception& error) {  // a backend as wrong as it likes
    shown.problem = error.what();
  }
  return shown;
}

ShownCase run_to_show(const std::function<std::unique_ptr<Backend>()>& make, const Case& c,
                      const std::vector<Command>& commands) {
  std::optional<History> history;
  ShownCase shown;
  try {
    history.emplace(make, c, true);
    for (const Command& command : commands) history->execute(command);
  } catch (const MachineError&) {
    throw;
  } catch (const std::exception& error) {
    shown.problem = error.what();
  }
  if (history && !history->trace().moments.empty()) shown.problem.clear();
  if (!shown.problem.empty()) return shown;
  shown.trace = history->trace();
  shown.loaded = {history->setup(), *shown.trace.initial};
  return shown;
}

namespace {

std::string words_of(const RunStages& run) {
  return counted(run.stages, "stage", "stages") + (run.whole && run.stages > 1 ? " as one span" : "");
}
std::string words_of(const Cut& cut) { return cut.stroke.down ? "one more stroke" : "one more stroke, blade up"; }
std::string words_of(const Kick& kick) { return fmt::format("a kick of piece {}", kick.component); }
std::string words_of(const SaveAndLoad& load) {
  return load.through_files ? "saved and loaded through files" : "saved and loaded";
}

}  // namespace

std::string in_words(const std::vector<Command>& commands) {
  std::string text;
  for (const Command& command : commands) {
    if (!text.empty()) text += ", then ";
    text += std::visit([](const auto& one) { return words_of(one); }, command);
  }
  return text;
}

namespace {

double spacings(int32_t quarters) { return quarters / 4.0; }

}  // namespace

std::string in_words(const Case& c) {
  std::string text = counted(c.nodes.size(), "particle", "particles");
  switch (c.clusters) {
    case ClusterKind::boxes:
      text += fmt::format(" in boxes of {} a side", counted(c.side, "node", "nodes"));
      break;
    case ClusterKind::tiles:
      text += fmt::format(" in tiles of {} a side", counted(c.side, "edge", "edges"));
      break;
    case ClusterKind::sampled:
      text += fmt::format(" in balls of {:g} h, {:g} h apart", spacings(c.ball_radius), spacings(c.seed_spacing));
      break;
    case ClusterKind::foreign:
      text += fmt::format(" in foreign clusters of at most {}", c.most);
      break;
  }
  const auto down = std::count_if(c.strokes.begin(), c.strokes.end(), [](const Stroke& one) { return one.down; });
  text += "; " + counted(c.strokes.size(), "stroke", "strokes");
  if (down < std::ssize(c.strokes)) text += fmt::format(", {} of them with the blade down", down);
  if (!c.strokes.empty()) text += fmt::format(", of a blade {:g} h thick", spacings(c.blade_thickness));
  if (c.together > 1) text += fmt::format(", {} in a frame", c.together);
  if (!c.moves) return text + "; nothing moves";
  text +=
      fmt::format("; the body moves: {} substeps × {} iterations, dt = {} µs", c.substeps, c.iterations, c.time_step);
  if (c.acceleration != Acceleration::none) text += ", accelerated";
  if (c.retardation > 0) text += fmt::format(", retarded by {:g} dt", c.retardation / 10.0);
  if (c.volume_share > 0) text += fmt::format(", {} % of the stiffness for its volume", c.volume_share);
  if (c.ground) text += ", gravity and a floor";
  if (!c.walls.empty()) text += ", " + counted(c.walls.size(), "wall", "walls");
  if (!c.grips.empty()) text += ", " + counted(c.grips.size(), "grip", "grips");
  return text;
}

}  // namespace cutproof::property_tests
