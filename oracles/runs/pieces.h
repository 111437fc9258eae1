// Which pieces a run's tissue must be in, by the blade's sweep alone (tolerances.md, Runs). Two partitions: `apart`
// cuts what the sweep surely crosses, `together` cuts all that it may have crossed. Internal to oracles/runs/.
#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "oracles/runs/run.h"

namespace cutproof::oracles {

// What is tissue at rest: pairs of particles at most 1.1 h apart along one axis, and no more than 0.2 h along the
// others together; pairs of cells that have a face in common. `corners`: 4 or 8. Particles that rest nowhere (NaN) join
// none. Nothing if h is not how far they are apart: in a box of h there are more than some, where all pairs would be
// too many, or one is so far away that h is about as large as its rounding.
inline constexpr std::size_t kMostWithinSpacing = 64;
inline constexpr double kFarthestInSpacings = 0x1p50;
std::optional<std::vector<std::array<int32_t, 2>>> tissue_at_rest(std::span<const Vec3> rest, double h);
std::vector<std::array<int32_t, 2>> tissue_of_cells(std::span<const int32_t> cells, int corners);

// Units of tissue are particles, or cells where a run has cells.
class SweptTissue {
 public:
  // `joined`: pairs of units that are tissue at rest.
  SweptTissue(int32_t units, std::vector<std::array<int32_t, 2>> joined);

  // What the blade sweeps from one frame to the next: quads of 4 corners each, where they lie at its end. `was`, `is`:
  // where units were and are [units]. `blur`: by how much a cut may lie beside the sweep, besides how far a unit moves
  // meanwhile against the tissue around it [m].
  void sweep(std::span<const Vec3> quads, std::span<const Vec3> was, std::span<const Vec3> is, double blur);
  // A unit that is gone joins nothing.
  void remove(int32_t unit) { gone_[static_cast<std::size_t>(unit)] = 1; }

  struct Pieces {
    std::vector<int32_t> label;  // [units] -1: gone
    int32_t count = 0;
  };
  Pieces apart() const { return pieces(true); }
  Pieces together() const { return pieces(false); }
  // Whether a unit lies so near to a sweep that it may be on either side of the cut.
  bool is_beside(int32_t unit) const { return beside_[static_cast<std::size_t>(unit)] != 0; }
  int64_t surely_cut() const { return surely_; }
  int64_t perhaps_cut() const { return perhaps_; }
  // Of these and of edges that are surely cut by now: how many were perhaps cut in some frame.
  int64_t ever_perhaps_cut() const { return ever_perhaps_; }

 private:
  // A border of a quad: where a sweep ends, unless another one goes on there.
  struct Border {
    Vec3 a, b;
  };
  struct Edge {
    int32_t a, b;
    enum class State : uint8_t { whole, perhaps, surely } state = State::whole;
    std::vector<Border> near = {};  // borders that a crossing is too near to, until a sweep goes on there
  };
  Pieces pieces(bool sure) const;
  void cut(Edge& edge, std::span<const Vec3> quads, std::span<const Vec3> was, std::span<const Vec3> is, double blur);

  std::vector<Edge> edges_;
  std::vector<uint8_t> gone_, beside_;
  std::vector<Vec3> last_;  // quads of the sweep before
  int64_t surely_ = 0, perhaps_ = 0, ever_perhaps_ = 0;
};

}  // namespace cutproof::oracles
