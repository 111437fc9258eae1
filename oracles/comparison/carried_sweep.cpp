#include "oracles/comparison/carried_sweep.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <optional>
#include <unordered_map>

#include "model/at.h"
#include "oracles/comparison/plate_sweep.h"
#include "oracles/eigen.h"
#include "oracles/oracles.h"

namespace cutproof::oracles {

namespace {

// As far as nearby particles do not say how the tissue is stretched, it is not: in units of their weight and h².
constexpr double kTowardsRotation = 0.01;

// Coordinates beyond have no digits left that tell one piece of the surface (kPiece h) from the next: 2⁵⁰ h × 2⁻⁵² is
// that piece. Within, the number of a cell, which is no smaller than kReach h, fits a whole number of 64 bits.
constexpr double kFarthest = 0x1p50;  // [h]

// The tissue of one frame, deformed beside at rest.
class Tissue {
 public:
  Tissue(const Body& body, const State& before, const State& after)
      : body_(body), before_(before), after_(after), reach_(CarriedSweep::kReach * body.grid.spacing) {
    // Particles that are nowhere, or farther away than numbers tell, are near nothing.
    const auto counts = [&](std::size_t i) {
      return before.alive[i] != 0 && is_placed(before.x[i]) && is_placed(after.x[i]);
    };
    double farthest = 0;
    for (std::size_t i = 0; i < before.alive.size(); ++i) {
      if (counts(i)) farthest = std::max(farthest, norm(after.x[i] - before.x[i]));
    }
    // By where particles began: one that is near at any time of the frame began in the same cell or beside it.
    cell_size_ = reach_ + farthest;
    for (std::size_t i = 0; i < before.alive.size(); ++i) {
      if (counts(i)) cells_[cell_of(before.x[i], {})].push_back(static_cast<int32_t>(i));
    }
  }

  // Where the tissue at `p`, `fraction` of the frame being over, rests.
  std::optional<Vec3> at_rest(Vec3 p, double fraction) const {
    if (!is_placed(p)) return std::nullopt;
    struct Near {
      Vec3 now, rest;
      double weight;
    };
    std::vector<Near> near;
    double total = 0;
    Vec3 now_mean, rest_mean;
    const auto look_at = [&](int32_t particle) {
      const std::size_t i = at(particle);
      const Vec3 now = before_.x[i] + fraction * (after_.x[i] - before_.x[i]);
      const double part = norm(now - p) / reach_;
      if (!(part < 1)) return;
      const double weight = (1 - part * part) * (1 - part * part);
      near.push_back({now, body_.rest_position(particle), weight});
      total += weight;
      now_mean += weight * now;
      rest_mean += weight * near.back().rest;
    };
    for (int k = 0; k < 27; ++k) {
      const auto found = cells_.find(cell_of(p, {k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1}));
      if (found != cells_.end()) std::for_each(found->second.begin(), found->second.end(), look_at);
    }
    if (!(total > 0)) return std::nullopt;
    now_mean = now_mean / total;
    rest_mean = rest_mean / total;
    Eigen::Matrix3d mixed = Eigen::Matrix3d::Zero(), own = Eigen::Matrix3d::Zero();
    for (const Near& each : near) {
      const Eigen::Vector3d now = as_eigen(each.now - now_mean), rest = as_eigen(each.rest - rest_mean);
      mixed += each.weight * rest * now.transpose();
      own += each.weight * now * now.transpose();
    }
    const double h = body_.grid.spacing, towards = kTowardsRotation * total * h * h;
    // Particles in a line or fewer leave a part of the rotation open: then as little of it as can be.
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(mixed + 1e-9 * towards * Eigen::Matrix3d::Identity(),
                                                Eigen::ComputeFullU | Eigen::ComputeFullV);
    Eigen::Matrix3d turned_over = Eigen::Matrix3d::Identity();
    turned_over(2, 2) = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1;
    const Eigen::Matrix3d rotation = svd.matrixU() * turned_over * svd.matrixV().transpose();
    const Eigen::Matrix3d map = (mixed + towards * rotation) * (own + towards * Eigen::Matrix3d::Identity()).inverse();
    const Eigen::Vector3d moved = map * as_eigen(p - now_mean);
    return rest_mean + Vec3{moved.x(), moved.y(), moved.z()};
  }

 private:
  // Not of NaN either.
  bool is_placed(Vec3 p) const {
    const double most = kFarthest * body_.grid.spacing;
    return std::abs(p.x) <= most && std::abs(p.y) <= most && std::abs(p.z) <= most;
  }

  // The cell with a point, or one beside it. Cells whose numbers are equal by chance cost time and change nothing.
  uint64_t cell_of(Vec3 p, std::array<int, 3> beside) const {
    uint64_t number = 0;  // without sign: it may wrap round
    for (int axis = 0; axis < 3; ++axis) {
      const int64_t cell = static_cast<int64_t>(std::floor(p[axis] / cell_size_)) + beside[at(axis)];
      number = number * 1'000'003 + static_cast<uint64_t>(cell);
    }
    return number;
  }

  const Body& body_;
  const State &before_, &after_;
  double reach_, cell_size_ = 0;
  std::unordered_map<uint64_t, std::vector<int32_t>> cells_;
};

// Points along a side of the plate, in the deformed tissue at a time, carried to rest.
std::vector<std::optional<Vec3>> carried_row(const Tissue& tissue, Vec3 a, Vec3 b, int pieces, double time) {
  std::vector<std::optional<Vec3>> row;
  for (int i = 0; i <= pieces; ++i) {
    const double s = static_cast<double>(i) / pieces;
    row.push_back(tissue.at_rest((1 - s) * a + s * b, time));
  }
  return row;
}

int pieces_of(double length, double piece) { return std::max(1, static_cast<int>(std::ceil(length / piece))); }

}  // namespace

bool CarriedSweep::wants(int64_t frame) const {
  if (!setup_.has_blade || frame < 0 || frame >= setup_.frame_count()) return false;
  const int64_t substeps = setup_.step.substeps;
  for (int64_t k = frame * substeps; k < (frame + 1) * substeps; ++k) {
    if (setup_.blade_moves[at(k)].down) return true;
  }
  return false;
}

void CarriedSweep::add_strip(const Row& from, const Row& to) {
  for (std::size_t i = 0; i + 1 < from.size(); ++i) {
    const auto &p = from[i], &q = from[i + 1], &r = to[i + 1], &u = to[i];
    if (!p || !q || !r || !u) continue;
    for (const std::array<Vec3, 3>& triangle : {std::array<Vec3, 3>{*p, *q, *r}, std::array<Vec3, 3>{*p, *r, *u}}) {
      if (norm(cross(triangle[1] - triangle[0], triangle[2] - triangle[0])) > 0) surface_.push_back(triangle);
    }
  }
}

void CarriedSweep::add(const State& before, const State& after) {
  if (!wants(before.frame)) return;
  if (!well_formed(setup_, before).holds || !well_formed(setup_, after).holds) {
    reached_ = {};  // the next piece must not continue across the gap
    return;
  }
  const Tissue tissue(setup_.body, before, after);
  const Blade& blade = setup_.blade;
  const double piece = kPiece * setup_.body.grid.spacing;
  const std::array<double, 4> lengths = {blade.length, blade.depth, blade.length, blade.depth};
  const int64_t substeps = setup_.step.substeps, first = before.frame * substeps;
  for (int64_t k = first; k < first + substeps; ++k) {
    const BladeMove& move = setup_.blade_moves[at(k)];
    if (!move.down) continue;
    const auto time = [&](double part) {
      return (static_cast<double>(k - first) + part) / static_cast<double>(substeps);
    };
    const BladeMove* const previous = k > 0 ? &setup_.blade_moves[at(k - 1)] : nullptr;
    if (previous == nullptr || !previous->down || previous->stroke != move.stroke) {
      reached_ = {};
      const auto [a, b, c, d] = plate_of(blade, move.from);
      const int deep = pieces_of(blade.depth, piece), across = pieces_of(blade.length, piece);
      Row last;
      for (int j = 0; j <= deep; ++j) {
        const double t = static_cast<double>(j) / deep;
        Row row = carried_row(tissue, (1 - t) * a + t * d, (1 - t) * b + t * c, across, time(0));
        if (j > 0) add_strip(last, row);
        last = std::move(row);
      }
    }
    const int turning = turning_pieces(setup_, move);
    for (int p = 0; p < turning; ++p) {
      const double begin = static_cast<double>(p) / turning, end = static_cast<double>(p + 1) / turning;
      const BladePose pose = pose_between(move.from, move.to, (begin + end) / 2);
      const auto from = plate_of(blade, pose_between(move.from, move.to, begin));
      const auto to = plate_of(blade, pose_between(move.from, move.to, end));
      const std::array<Vec3, 4> outwards = {-pose.back, pose.along, pose.back, -pose.along};
      for (std::size_t side = 0; side < 4; ++side) {
        const std::size_t next = (side + 1) % 4;
        Row& reached = reached_[side];
        const Vec3 moved = 0.5 * (to[side] + to[next] - from[side] - from[next]);
        if (dot(moved, outwards[side]) <= 1e-6 * norm(moved)) {  // it follows, or slides along itself
          reached.clear();
          continue;
        }
        // Where it goes on, from the very points at which it was, so that the surface has no gap between frames.
        const int across = pieces_of(lengths[side], piece);
        const int on = pieces_of(std::max(norm(to[side] - from[side]), norm(to[next] - from[next])), piece);
        if (reached.empty()) reached = carried_row(tissue, from[side], from[next], across, time(begin));
        for (int j = 1; j <= on; ++j) {
          const double t = static_cast<double>(j) / on;
          Row row = carried_row(tissue, (1 - t) * from[side] + t * to[side], (1 - t) * from[next] + t * to[next],
                                across, time(begin + t * (end - begin)));
          add_strip(reached, row);
          reached = std::move(row);
        }
      }
    }
  }
}

}  // namespace cutproof::oracles
