#include "benchmarks/suites/sampling.h"

#include <fmt/format.h>

#include <algorithm>

namespace cutproof::benchmarks {

namespace {

// What the paper's counts of particles are divided by where nobody wants to wait.
constexpr int64_t kScaledDown = 16;

}  // namespace

bool SamplingResult::holds() const {
  return std::all_of(rows.begin(), rows.end(), [](const SamplingRow& row) { return row.scene.measured.holds(); });
}

nlohmann::json to_json(const SamplingResult& result) {
  nlohmann::json document = begin_document(result.provenance, result.complete);
  document["frames"] = result.frames;
  document["repeats"] = result.repeats;
  document["cooking"] = result.cooking;
  document["scaled_down"] = result.scaled_down;
  document["holds"] = result.holds();
  document["rows"] = nlohmann::json::array();
  for (const SamplingRow& row : result.rows) {
    nlohmann::json entry = to_json(row.scene);
    entry["frame_to_first"] = row.frame_to_first;
    entry["paper"] = {{"particles", row.paper.particles},
                      {"clusters", row.paper.clusters},
                      {"frame_seconds", 1e-3 * row.paper.frame_ms},
                      {"frame_to_first", row.paper_frame_to_first}};
    document["rows"].push_back(std::move(entry));
  }
  return document;
}

SamplingResult run_sampling(const SamplingOptions& options, const Progress<SamplingResult>& progress) {
  const Cooking cooking = cooking_of(options.cooking);
  const std::vector<Contender> contenders = make_contenders(options.backend, options.split, options.rotation);
  SamplingResult result;
  result.provenance = provenance_of("sampling", options.backend);
  result.frames = options.frames_or_default();
  result.repeats = options.repeats;
  result.cooking = options.cooking;
  result.scaled_down = options.full || options.described().takes_full_size ? 1 : kScaledDown;
  progress(result);
  for (const Contender& contender : contenders) {
    double first_frame = 0;
    for (const PaperSampling& paper : paper_samplings()) {
      const int64_t wanted = paper.particles / result.scaled_down;
      const BenchScene scene =
          make_paper_scene("kidney_101096", fmt::format("kidney_{}", wanted), wanted, cooking, result.frames);
      SamplingRow row{scene_row(scene, contender, measure(contender, scene, result.frames, options.repeats)), paper, 0,
                      paper.frame_ms / paper_samplings().front().frame_ms};
      const double frame = row.scene.measured.timings.frame.median;
      if (first_frame == 0) first_frame = frame;
      row.frame_to_first = frame / first_frame;
      result.rows.push_back(std::move(row));
      result.complete = &contender == &contenders.back() && &paper == &paper_samplings().back();
      progress(result);
    }
  }
  return result;
}

}  // namespace cutproof::benchmarks
