#include "benchmarks/suites/scale.h"

#include <algorithm>

#include "benchmarks/memory.h"

namespace cutproof::benchmarks {

namespace {

using nlohmann::json;

std::vector<int64_t> sizes_of(const ScaleOptions& options) {
  require_timed_sizes(options.sizes);
  if (!options.sizes.empty()) return options.sizes;
  if (options.described().takes_full_size) {
    return {1000, 3000, 10'000, 30'000, 100'000, 300'000, 1'000'000, 3'000'000, 10'000'000};
  }
  return {1000, 3000, 10'000};  // less than a minute
}

}  // namespace

bool ScaleResult::holds() const {
  return std::all_of(rows.begin(), rows.end(), [](const ScaleRow& row) { return row.scene.measured.holds(); });
}

json to_json(const ScaleResult& result) {
  json document = begin_document(result.provenance, result.complete);
  document["frames"] = result.frames;
  document["repeats"] = result.repeats;
  document["holds"] = result.holds();
  document["rows"] = json::array();
  for (const ScaleRow& row : result.rows) {
    json entry = to_json(row.scene);
    entry["particles_per_second"] = row.particles_per_second;
    entry["bytes"] = row.bytes ? json(*row.bytes) : json(nullptr);
    document["rows"].push_back(std::move(entry));
  }
  return document;
}

ScaleResult run_scale(const ScaleOptions& options, const Progress<ScaleResult>& progress) {
  const std::vector<int64_t> sizes = sizes_of(options);
  std::vector<Contender> contenders = make_contenders(options.backend, options.split, options.rotation);
  ScaleResult result;
  result.provenance = provenance_of("scale", options.backend);
  result.frames = options.frames_or_default();
  result.repeats = options.repeats;
  progress(result);
  for (std::size_t k = 0; k < sizes.size(); ++k) {
    const BenchScene scene = make_bench_scene(sizes[k], result.frames);
    // New ones for each size, so that what one keeps is what this size needs.
    contenders = make_contenders(options.backend, options.split, options.rotation);
    for (const Contender& contender : contenders) {
      const std::optional<int64_t> before = bytes_in_use(options.described());
      Measured measured = measure(contender, scene, result.frames, options.repeats);
      const std::optional<int64_t> after = bytes_in_use(options.described());
      ScaleRow row{scene_row(scene, contender, std::move(measured)), 0, {}};
      row.particles_per_second = static_cast<double>(row.scene.particles) / row.scene.measured.timings.frame.median;
      if (before && after && *after > *before) row.bytes = *after - *before;
      result.rows.push_back(std::move(row));
      result.complete = k + 1 == sizes.size() && &contender == &contenders.back();
      progress(result);
    }
  }
  return result;
}

}  // namespace cutproof::benchmarks
