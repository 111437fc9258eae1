#include "benchmarks/prepared_scene.h"

#include <algorithm>
#include <utility>

namespace cutproof::benchmarks {

PreparedScene::PreparedScene(const Scene& scene, const std::string& source, std::optional<int64_t> frames) {
  fixtures::BuildOptions options;
  options.frames = frames;
  fixtures::Built built = fixtures::build(scene, source, options);
  setup_ = std::move(built.setup);
  start_ = std::move(built.state);
  report_ = {std::move(built.repair), std::move(built.notes)};
  const std::vector<int32_t>& scene_frame = built.schedule.scene_frame;
  for (std::size_t f = 0; f < scene_frame.size(); ++f) {
    if (f + 1 == scene_frame.size() || scene_frame[f + 1] != scene_frame[f])
      last_of_.push_back(static_cast<int64_t>(f));
  }
}

double PreparedScene::run(Backend& backend, const std::function<bool(double seconds)>& see) const {
  double seconds = 0;
  backend.load({setup_}, {start_});
  for (int64_t frame = 0; frame < frame_count(); ++frame) {
    for_parts_of(frame, [&] {
      backend.run({Stage::step, Stage::skin});
      seconds += backend.report().total_seconds;
    });
    if (see && !see(seconds)) break;
  }
  return seconds;
}

std::vector<int64_t> PreparedScene::stroke_end() const {
  std::vector<int64_t> ends;
  for (const int64_t frame : setup_.stroke_end) {
    const auto found = std::lower_bound(last_of_.begin(), last_of_.end(), frame);
    ends.push_back(frame < 0 || found == last_of_.end() ? -1 : found - last_of_.begin());
  }
  return ends;
}

}  // namespace cutproof::benchmarks
