#include "benchmarks/measured_scene.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "benchmarks/memory.h"
#include "benchmarks/report.h"
#include "benchmarks/times.h"
#include "model/at.h"
#include "model/io/filled.h"
#include "model/io/json_number.h"
#include "model/io/verdict_json.h"
#include "model/rules.h"

namespace cutproof::benchmarks {

namespace {

using nlohmann::json;

json to_json(const oracles::ErrorNorm& norm) {
  return {{"max_h", json_number(norm.max)}, {"rms_h", json_number(norm.rms())}, {"beyond", norm.beyond}};
}

json error_of_stage(Stage stage, const Measured& measured) {
  const FrameErrors& judged = *measured.judged;
  json error;
  if (stage == Stage::step && judged.step) {
    error = to_json(judged.step->position);
    error["not_compared"] = judged.step->undecidable;
  } else if (stage == Stage::detect && judged.detect) {
    const auto& [removed, differing, within_rounding] = *judged.detect;
    error = {{"removed", removed}, {"differing", differing}, {"within_rounding", within_rounding}};
  } else if (stage == Stage::skin && judged.skin) {
    error = to_json(judged.skin->vertices);
    error["triangles_equal"] = judged.skin->triangles_equal;
  } else if (const auto equal = judged.clusters_equal[at(stage)]) {
    error = {{"clusters_equal", *equal}};
    if (stage == Stage::expand) error["added"] = measured.added;
  }
  return error;
}

}  // namespace

Measured measure(const Contender& contender, const BenchScene& scene, int64_t frames, int64_t repeats,
                 const WhenTimed& timed) {
  Backend& backend = *contender.instance;
  Measured measured;
  const std::optional<int64_t> before = bytes_in_use(*contender.described);
  measured.timings = time_stages(backend, scene, frames, contender.described->pipelines, repeats);
  const std::optional<int64_t> after = bytes_in_use(*contender.described);
  if (before && after && *after > *before) measured.bytes = *after - *before;
  const auto begin = Clock::now();
  if (scene.setup.body.particle_count() <= kMostJudgedParticles) {
    if (timed) timed(measured);
    const bool expands = measured.timings.stage[at(Stage::expand)].count > 0;
    measured.added = expands ? count_added_memberships(backend, scene, frames) : 0;
    measured.judged = judge_frames(backend, scene.setup);
  }
  measured.judge_seconds = seconds_since(begin);
  return measured;
}

json error_of(const std::string& what, const Measured& measured) {
  if (!measured.judged) return nullptr;
  for (const Stage stage : kStages) {
    if (what == name_of(stage)) return error_of_stage(stage, measured);
  }
  json error = {{"topology_holds", measured.judged->topology_holds()},
                {"isolated_groups", measured.judged->isolated_groups}};
  json failed = json::array();
  for (const Verdict& verdict : measured.judged->topology) {
    if (!verdict.holds) failed.push_back(io::verdict_json(verdict, false));
  }
  if (!failed.empty()) error["failed"] = std::move(failed);
  return error;
}

std::string in_words(const json& error, const std::string& nothing) {
  if (error.is_null()) return nothing;
  std::string text;
  const auto say = [&](bool applies, const char* words) {
    if (applies) text += (text.empty() ? "" : ", ") + io::filled(words, error);
  };
  const auto say_whether = [&](const char* field, const char* yes, const char* no) {
    if (error.contains(field)) say(true, error.at(field) ? yes : no);
  };
  const auto some = [&](const char* field) { return error.value(field, 0.0) > 0; };
  say(error.contains("max_h"), "{max_h:.2g} h max, {rms_h:.2g} h RMS");
  say(some("beyond"), "{beyond} beyond 1e-04 h");  // oracles::kPositionsWanted
  say(some("not_compared"), "{not_compared} inconclusive within rounding");
  say_whether("triangles_equal", "triangles equal", "triangles NOT equal");
  say(error.contains("removed"), "{differing} of {removed} removals differ");
  if (some("differing")) say_whether("within_rounding", "all within rounding", "NOT all within rounding");
  say_whether("clusters_equal", "clusters equal", "clusters NOT equal");
  say(error.contains("added"), "{added} memberships added");
  say_whether("topology_holds", "topology holds", "topology FAILS");
  say(some("isolated_groups"), "{isolated_groups:g} isolated groups");
  return text;
}

json run_fields(const BenchScene& scene, const Contender& contender) {
  const Setup& setup = scene.setup;
  return {{"scene", scene.name},
          {"particles", setup.body.particle_count()},
          {"backend", contender.described->name},
          {"precision", name_of(contender.described->precision)},
          {"substeps", setup.step.substeps},
          {"iterations", setup.step.iterations},
          {"acceleration", name_of(setup.step.acceleration)},
          {"remove", name_of(setup.detect.remove)}};
}

json scene_row(const BenchScene& scene, const Contender& contender, const Measured& measured) {
  json row = run_fields(scene, contender);
  row["clusters"] = scene.state.clusters.count();
  row["memberships"] = scene.state.clusters.members.size();
  row["spacing"] = scene.setup.body.grid.spacing;
  row["judged_frames"] = measured.judged ? measured.judged->frames : 0;
  json seconds = json::object(), errors = {{"frame", error_of("frame", measured)}};
  for (const auto& [what, times] : measured.timings.named()) seconds[what] = to_json(times);
  for (const std::string_view stage : kStageNames) errors[std::string(stage)] = error_of(std::string(stage), measured);
  row["seconds"] = std::move(seconds);
  row["error"] = std::move(errors);
  return row;
}

std::vector<StepParameters> steps_of(const TimingOptions& options, const StepParameters& own) {
  StepParameters step = own;
  step.iterations = options.iterations.value_or(own.iterations);
  if (options.acceleration.empty()) return {step};
  std::vector<StepParameters> steps;
  for (const std::string& word : options.acceleration) {
    const auto known = choice_named<Acceleration>(word);
    require_option(known.has_value(), "--acceleration", fmt::format("there is no acceleration '{}'", word),
                   fmt::format("use {}", fmt::join(names_of(Acceleration{}), " and ")));
    step.acceleration = *known;
    steps.push_back(step);
  }
  return steps;
}

DetectParameters detection_of(const TimingOptions& options, const DetectParameters& own) {
  DetectParameters detect = own;
  if (options.remove.empty()) return detect;
  const auto known = choice_named<RemovedEnds>(options.remove);
  require_option(known.has_value(), "--remove", fmt::format("there is no '{}' of the ends of an edge", options.remove),
                 fmt::format("use {}", fmt::join(names_of(RemovedEnds{}), " or ")));
  require_option(*known == RemovedEnds::both || own.criterion == Criterion::distance, "--remove",
                 fmt::format("a scene's criterion is {}, which judges particles, not edges", name_of(own.criterion)),
                 "leave it out, or leave that scene out with --scenes");
  detect.remove = *known;
  return detect;
}

}  // namespace cutproof::benchmarks
