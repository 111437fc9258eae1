#include "harness/foreign_run.h"

#include <algorithm>
#include <memory>
#include <optional>
#include <utility>

#include "harness/run_frames.h"

namespace cutproof::harness {

bool JudgedRun::holds() const {
  return verdicts.size() > 1 && std::all_of(verdicts.begin(), verdicts.end(), [](const Verdict& v) { return v.holds; });
}

JudgedRun judge_run(io::RunSegments& segments, const std::function<void(int64_t)>& frame_done) {
  JudgedRun judged;
  std::unique_ptr<oracles::RunJudge> judge;
  bool is_deterministic = false;
  for (RunFrames frames(segments); frames.next();) {
    const RunSegment& segment = frames.segment();
    if (!judge) {
      const oracles::RunHeader header = segment.header();
      is_deterministic = header.promised(oracles::RunPromise::deterministic);
      judge = std::make_unique<oracles::RunJudge>(header);
      judged.particles_at_start = segment.particles();
      judged.single_precision = segment.precision() == Precision::binary32;
    }
    if (frames.begins_segment()) {
      for (const Array& array : segment.contents().arrays) judged.given.insert(array.name);
      judged.notes.insert(judged.notes.end(), segment.arrays().notes().begin(), segment.arrays().notes().end());
      if (std::optional<std::vector<double>> mass = segment.mass()) judge->weigh(std::move(*mass));
      if (std::optional<oracles::RunCoupling> coupling = segment.coupling()) judge->couple(std::move(*coupling));
      judged.particles_at_end = segment.particles();
      ++judged.segments;
    }
    judge->see(frames.frame());
    if (frame_done) frame_done(judged.frames);
    ++judged.frames;
  }
  judge->finish();
  judged.verdicts = judge->verdicts();
  for (const auto& [property, why] : judge->not_asked()) judged.not_judged.push_back({property, why});
  if (is_deterministic) judged.not_judged.push_back({"determinism", "one run does not show what another one does"});
  if (judged.given.contains("vertices")) judged.not_judged.push_back({"skin", "the skin of a run is not judged"});
  judged.pieces = judge->pieces();
  for (const std::string& note : judge->notes()) judged.notes.push_back(note);
  return judged;
}

}  // namespace cutproof::harness
