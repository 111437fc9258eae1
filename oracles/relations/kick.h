// No ghost force, asked of a simulator of which nothing is known but where its particles were: in a run, and in the
// same run with one piece kicked, once or several times (oracles.md, A kick). Needs no backend.
#pragma once
#include <cstdint>
#include <optional>
#include <vector>

#include "model/precision.h"
#include "model/vec.h"
#include "model/verdict.h"

namespace cutproof::oracles {

// The run with one kick.
struct KickedRun {
  std::vector<double> positions;  // [frames][n][3] [m]
  std::optional<int32_t> piece;   // which one was kicked; not given: the one that is off first
  std::optional<Vec3> direction;  // of the kick; its norm is positive and finite
  int32_t equal = -1;             // kicks of one number are answered equally; below 0: a kick by itself
};

struct KickedRuns {
  int64_t frames = 0;
  int32_t particles = 0;
  std::vector<double> positions;  // [frames][n][3] [m] without a kick, as doubles whatever they were computed in
  std::vector<KickedRun> kicks;
  // [frames][n] 1: the particle exists, in every run. Empty: in each run from the first frame on in which one of its
  // coordinates is a number.
  std::vector<uint8_t> alive;
  std::vector<double> again;   // the first run once more; empty: not given
  std::vector<int32_t> piece;  // [n] which particles belong together
  std::vector<double> mass;    // [n] [kg], of which centres are; empty: all alike
  double tolerance = 0;        // share of a kick that other pieces may feel, and by which equal answers may differ
  int64_t steps = 1;           // substeps in a frame
  double spacing = 0;          // h [m], for the report; 0: not known
  Precision precision = Precision::binary64;  // of the positions
};

// The motion of one piece.
struct KickedPiece {
  int32_t piece = 0;
  int64_t particles = 0;
  int64_t felt = 0;          // particles that were beyond the bound in some frame
  int64_t first_frame = -1;  // in which one was; -1: none
  double greatest = 0;       // difference of a position in any frame [m]; infinite: a particle exists in one run alone
  double centre = 0;         // of its centre of mass in any frame [m]
  double of_kick = 0;        // greatest, divided by how far a particle of the kicked piece was off
};

// What one kick did.
struct KickAnswer {
  // "the kick was felt", "the answer follows the kick", "no ghost force"; after the first fails there are no others.
  std::vector<Verdict> verdicts;
  std::vector<KickedPiece> pieces;      // by name
  std::optional<int32_t> kicked_piece;  // as given, or as found
  int64_t kick_frame = -1;              // the first in which it moved otherwise
  // The sharpest that was asked: the least bound of a frame since the kick, and how far the kicked piece was off then
  // [m].
  double least_bound = 0, kick_then = 0;
  int64_t sharpest_frame = -1;
};

struct KickReport {
  std::vector<Verdict> verdicts;  // of the file: "finite", "something was judged", "equal answers" of each group
  std::vector<KickAnswer> kicks;  // none if not all is finite
  bool repeats = true;            // `again` has the numbers of `positions`, or was not given
  int64_t judged_frames = 0;      // the first so many; of later ones nobody knows the noise

  std::vector<Verdict> all() const;  // of the file, then kick by kick
  bool holds() const;
};

// Requires arrays of the sizes that they are to have; the piece of a kick, if given, is one of the pieces.
KickReport judge_kick(const KickedRuns& runs);

}  // namespace cutproof::oracles
