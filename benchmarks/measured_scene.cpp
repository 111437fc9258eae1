#include "benchmarks/measured_scene.h"

#include <fmt/format.h>

#include "benchmarks/times.h"
#include "model/at.h"
#include "model/io/json_number.h"

namespace cutproof::benchmarks {

namespace {

using nlohmann::json;

json to_json(const oracles::ErrorNorm& norm) {
  return {{"max_h", json_number(norm.max)}, {"rms_h", json_number(norm.rms())}, {"beyond", norm.beyond}};
}
std::string in_words(const oracles::ErrorNorm& norm) {
  std::string text = fmt::format("{:.2g} h max, {:.2g} h RMS", norm.max, norm.rms());
  if (norm.beyond > 0) text += fmt::format(", {} beyond {:.0e} h", norm.beyond, oracles::kPositionsWanted);
  return text;
}

}  // namespace

Measured measure(const Contender& contender, const BenchScene& scene, int64_t frames, int64_t repeats) {
  Backend& backend = *contender.instance;
  Measured measured;
  measured.timings = time_stages(backend, scene, frames, contender.pipelined, repeats);
  const auto begin = Clock::now();
  if (scene.setup.body.particle_count() <= kMostJudgedParticles) {
    const bool expands = measured.timings.stage[at(Stage::expand)].count > 0;
    measured.added = expands ? count_added_memberships(backend, scene, frames) : 0;
    measured.judged = judge_frames(backend, scene.setup);
  }
  measured.judge_seconds = seconds_since(begin);
  return measured;
}

ErrorColumn error_of(Stage stage, const Measured& measured) {
  if (!measured.judged) return {"not measured", nullptr};
  const FrameErrors* const judged = &*measured.judged;
  switch (stage) {
    case Stage::step:
      if (const auto& s = judged->step) {
        ErrorColumn error = {in_words(s->position), to_json(s->position)};
        error.value["undecidable"] = s->undecidable;
        if (s->undecidable > 0) error.text += fmt::format(", {} undecidable within rounding", s->undecidable);
        return error;
      }
      break;
    case Stage::detect:
      if (const auto& d = judged->detect) {
        std::string text = fmt::format("{} of {} removals differ", d->differing, d->removed);
        if (d->differing > 0) text += d->within_rounding ? ", all within rounding" : ", NOT all within rounding";
        return {text, {{"removed", d->removed}, {"differing", d->differing}, {"within_rounding", d->within_rounding}}};
      }
      break;
    case Stage::skin:
      if (const auto& s = judged->skin) {
        json value = to_json(s->vertices);
        value["triangles_equal"] = s->triangles_equal;
        return {in_words(s->vertices) + (s->triangles_equal ? ", triangles equal" : ", triangles NOT equal"), value};
      }
      break;
    default:
      if (const auto equal = judged->clusters_equal[at(stage)]) {
        ErrorColumn error = {*equal ? "clusters equal" : "clusters NOT equal", {{"clusters_equal", *equal}}};
        if (stage == Stage::expand) {
          error.text += fmt::format(", {} memberships added", measured.added);
          error.value["added"] = measured.added;
        }
        return error;
      }
  }
  return {"did not run", nullptr};
}

ErrorColumn error_of_frame(const Measured& measured) {
  if (!measured.judged) return {"not measured", nullptr};
  const bool holds = measured.judged->topology_holds();
  const double isolated = measured.judged->isolated_groups;
  std::string text = holds ? "topology holds" : "topology FAILS";
  if (isolated > 0) text += fmt::format(", {} isolated groups", isolated);
  return {text, {{"topology_holds", holds}, {"isolated_groups", isolated}}};
}

json errors_by_stage(const Measured& measured) {
  json errors = {{"frame", error_of_frame(measured).value}};
  for (const Stage stage : kStages) errors[std::string(name_of(stage))] = error_of(stage, measured).value;
  return errors;
}

SceneRow scene_row(const BenchScene& scene, const Contender& contender, Measured measured) {
  const Setup& setup = scene.setup;
  const Clusters& clusters = scene.state.clusters;
  return {scene.name,
          setup.body.particle_count(),
          clusters.count(),
          static_cast<int64_t>(clusters.members.size()),
          setup.body.grid.spacing,
          contender.backend,
          contender.precision,
          contender.rotation,
          contender.split,
          setup.step.substeps,
          setup.step.iterations,
          std::move(measured)};
}

json to_json(const SceneRow& row) {
  return {{"scene", row.scene},
          {"particles", row.particles},
          {"clusters", row.clusters},
          {"memberships", row.memberships},
          {"spacing", row.spacing},
          {"backend", row.backend},
          {"precision", row.precision},
          {"substeps", row.substeps},
          {"iterations", row.iterations},
          {"rotation", row.rotation},
          {"split", row.split},
          {"seconds", seconds_by_stage(row.measured.timings)},
          {"error", errors_by_stage(row.measured)},
          {"judged_frames", row.measured.judged ? row.measured.judged->frames : 0}};
}

}  // namespace cutproof::benchmarks
