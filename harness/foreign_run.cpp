#include "harness/foreign_run.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "harness/run_skin.h"

namespace cutproof::harness {

using oracles::RunPromise;

bool JudgedRun::holds() const {
  return verdicts.size() > 1 && std::all_of(verdicts.begin(), verdicts.end(), [](const Verdict& v) { return v.holds; });
}

JudgedRun judge_run(io::RunSegments segments,
                    const std::function<void(int64_t, const oracles::RunJudge&)>& frame_done) {
  JudgedRun judged;
  std::optional<oracles::RunJudge> judge;
  RunFrames frames(std::move(segments));
  RunSkin skin;
  while (frames.next()) {
    const oracles::RunFrame& frame = frames.frame();
    const RunSegment& segment = frames.segment();
    if (!judge) {
      judge.emplace(frames.header());
      judged.particles_at_start = segment.particles();
      judged.single_precision = segment.precision() == Precision::binary32;
    }
    if (frames.begins_segment()) {
      for (const Array& array : segment.contents().arrays) judged.given.insert(array.name);
      judged.notes.insert(judged.notes.end(), segment.arrays().notes().begin(), segment.arrays().notes().end());
      if (std::vector<double> mass = segment.mass(); !mass.empty()) judge->weigh(std::move(mass));
      if (frames.has_new_coupling()) judge->couple(*frames.coupling());
    }
    judge->see(frame);
    skin.see(frames, *judge);
    if (frame_done) frame_done(frame.index, *judge);
    ++judged.frames;
    judged.particles_at_end = segment.particles();
  }
  judged.segments = frames.segments();
  judge->finish();
  judged.verdicts = judge->verdicts();
  for (const auto& [property, why] : judge->not_asked()) judged.not_judged.push_back({property, why});
  if (frames.header().promised(RunPromise::deterministic))
    judged.not_judged.push_back({"determinism", "one run shows no relation to another one"});
  skin.finish(frames.header().promised(RunPromise::skin), judged);
  judged.pieces = judge->pieces();
  for (const std::string& note : judge->notes()) judged.notes.push_back(note);
  return judged;
}

}  // namespace cutproof::harness
