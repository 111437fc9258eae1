// No ghost force, asked of a simulator of which nothing is known but where its particles were: in a run, and in the
// same run with one piece kicked (oracles.md, A kick). Needs no backend.
#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "model/precision.h"
#include "model/verdict.h"

namespace cutproof::oracles {

struct KickedRuns {
  int64_t frames = 0;
  int32_t particles = 0;
  // [frames][n][3] positions [m], as doubles whatever they were computed in.
  std::vector<double> positions, kicked;
  // [frames][n] 1: the particle exists, in every run. Empty: in each run from the first frame on in which one of its
  // coordinates is a number.
  std::vector<uint8_t> alive;
  std::vector<double> again;   // the first run once more; empty: not given
  std::vector<int32_t> piece;  // [n] which particles belong together
  std::optional<int32_t> kicked_piece;
  double spacing = 0;                         // h [m], for the report; 0: not known
  Precision precision = Precision::binary64;  // of the positions
};

// What became of one piece.
struct KickedPiece {
  int32_t piece = 0;
  int64_t particles = 0;
  int64_t felt = 0;          // particles that were beyond the bound in some frame
  int64_t first_frame = -1;  // in which one was; -1: none
  double greatest = 0;       // difference of a position in any frame [m]; infinite: a particle exists in one run alone
};

struct KickReport {
  // "finite", "the kick was felt", "something was judged", "no ghost force"; those that make no sense any more after a
  // failure are not there.
  std::vector<Verdict> verdicts;
  std::vector<KickedPiece> pieces;      // by name
  std::optional<int32_t> kicked_piece;  // as given, or as found
  int64_t kick_frame = -1;              // the first in which it moved otherwise
  bool repeats = true;                  // `again` has the numbers of `positions`, or was not given
  // The sharpest that was asked: the least bound of a frame since the kick, and how far the kicked piece was off then
  // [m].
  double least_bound = 0, kick_then = 0;
  int64_t sharpest_frame = -1;
  int64_t judged_frames = 0;  // the first so many; of later ones nobody knows the noise

  bool holds() const;
};

// By how much positions of two runs of one start may differ that nothing but the simulator's own noise tells apart,
// frame
// by frame [m] (tolerances.md, A kick in a noisy simulator). All 0 if it repeats itself; infinite where it is not
// known.
std::vector<double> noise_bounds(const KickedRuns& runs);

// Requires arrays of the sizes that they are to have; kicked_piece, if given, is one of the pieces.
KickReport judge_kick(const KickedRuns& runs);

}  // namespace cutproof::oracles
