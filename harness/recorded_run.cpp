#include "harness/recorded_run.h"

#include <algorithm>
#include <string>
#include <utility>

namespace cutproof::harness {

std::vector<Verdict> walk_recording(const io::RecordingReader& reader, const Snapshot& initial, const Observer& observe,
                                    const std::function<void(const FrameResult&)>& frame_done) {
  const Setup& setup = reader.header().setup;
  std::vector<Verdict> wrong;
  Snapshot before = initial;
  Stage next = Stage::step;
  FrameResult frame;
  frame.frame = initial->frame;
  for (int64_t index = 1; index < reader.header().snapshot_count; ++index) {
    io::Snapshot read = reader.snapshot(index);
    const auto after = std::make_shared<const State>(std::move(read.state));
    const Stage last = read.stage;
    if (last < next) {
      wrong.push_back(broken_contract("snapshots come in the order of stages", last, frame.frame));
      wrong.back().witness.text = "snapshot " + std::to_string(index) + " is after " + std::string(name_of(last)) +
                                  ", where one after " + std::string(name_of(next)) + " or later should follow";
      next = last;
    }
    const Span span = {next, last};
    const auto due = due_stages(setup, *before, span, *after);
    for (std::size_t s = 0; s < due.size(); ++s) frame.ran[s] = frame.ran[s] || due[s];
    // Of what is due nothing was left; or where nothing is, the stage that was recorded was not.
    const std::array<bool, 6>& left = reader.header().left_to_reference;
    const bool any_due = std::find(due.begin(), due.end(), true) != due.end();
    bool by_backend = any_due || !left[static_cast<std::size_t>(last)];
    for (std::size_t s = 0; s < due.size(); ++s) by_backend = by_backend && !(due[s] && left[s]);
    observe({0, span, std::exchange(before, after), after, by_backend});
    next = last == Stage::skin ? Stage::step : static_cast<Stage>(static_cast<int>(last) + 1);
    if (last != Stage::skin) continue;
    count(frame, *after);
    frame_done(frame);
    const int64_t ended = frame.frame;
    frame = {};
    frame.frame = ended + 1;
  }
  return wrong;
}

}  // namespace cutproof::harness
