#include <fmt/format.h>

#include "benchmarks/paper.h"
#include "benchmarks/suites/suites.h"

namespace cutproof::benchmarks {

namespace {

constexpr const char* kKidney = "kidney_101096";
// Divides the paper's numbers of particles for a quick run.
constexpr int64_t kScaledDown = 16;

}  // namespace

nlohmann::json run_sampling(const SamplingOptions& options, const Progress& progress) {
  const Cooking cooking = cooking_of(options.cooking);
  const Contender contender = make_contender(options.backend);
  const std::vector<StepParameters> steps = steps_of(options, embedded_scene(kKidney).step);
  static_cast<void>(detection_of(options, {}));
  const int64_t frames = options.frames_or_default();
  const int64_t scaled_down = options.full || options.described().takes_full_size ? 1 : kScaledDown;
  Report report("sampling", options.backend,
                {{"frames", frames},
                 {"repeats", options.repeats},
                 {"cooking", options.cooking},
                 {"scaled_down", scaled_down},
                 {"rows_at_most", steps.size() * paper_samplings().size()},
                 {"holds", true}},
                progress);
  for (const StepParameters& step : steps) {
    double first_frame = 0;
    for (const PaperSampling& paper : paper_samplings()) {
      const int64_t wanted = paper.particles / scaled_down;
      BenchScene scene = make_paper_scene(kKidney, fmt::format("kidney_{}", wanted), wanted, cooking, frames);
      scene.setup.step = step;
      scene.setup.detect = detection_of(options, scene.setup.detect);
      const Measured measured = measure(contender, scene, frames, options.repeats);
      const double frame = measured.timings.frame.median;
      if (first_frame == 0) first_frame = frame;
      nlohmann::json row = scene_row(scene, contender, measured);
      row["frame_to_first"] = nullptr;
      row["paper"] = {{"particles", paper.particles},
                      {"clusters", nullptr},
                      {"frame_seconds", 1e-3 * paper.frame_ms},
                      {"frame_to_first", nullptr}};
      if (paper.clusters) {
        row["frame_to_first"] = frame / first_frame;
        row["paper"]["clusters"] = *paper.clusters;
        row["paper"]["frame_to_first"] = paper.frame_ms / paper_samplings().front().frame_ms;
      }
      report.add(std::move(row), measured.holds());
    }
  }
  return report.complete();
}

}  // namespace cutproof::benchmarks
