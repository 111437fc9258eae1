#include "harness/run_states.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "model/at.h"
#include "model/bare_graph.h"
#include "model/error.h"

namespace cutproof::harness {

namespace {

constexpr double kNowhere = std::numeric_limits<double>::quiet_NaN();

using Edges = std::vector<std::array<int32_t, 2>>;

// Corners of a cell that an edge of it joins.
Edges edges_of_cells(const oracles::RunCoupling& coupling) {
  constexpr int kOfTetrahedron[6][2] = {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}};
  constexpr int kOfHexahedron[12][2] = {{0, 1}, {1, 2}, {2, 3}, {3, 0}, {4, 5}, {5, 6},
                                        {6, 7}, {7, 4}, {0, 4}, {1, 5}, {2, 6}, {3, 7}};
  Edges edges;
  for (std::size_t first = 0; first < coupling.cells.size(); first += at(coupling.corners)) {
    for (int k = 0; k < (coupling.corners == 4 ? 6 : 12); ++k) {
      const auto& [a, b] = coupling.corners == 4 ? kOfTetrahedron[k] : kOfHexahedron[k];
      edges.push_back({coupling.cells[first + at(a)], coupling.cells[first + at(b)]});
    }
  }
  return edges;
}

// Invalid values are left out.
void put_edges(Body& body, const Edges& edges) {
  const auto n = static_cast<int32_t>(body.rest.size());
  std::vector<std::pair<int32_t, int32_t>> possible;
  for (const auto& [a, b] : edges) {
    if (a >= 0 && b >= 0 && a < n && b < n && a != b) possible.emplace_back(a, b);
  }
  set_edges(body, std::move(possible));
}

}  // namespace

double plausible_spacing(const Body& body) {
  std::vector<double> lengths;
  const auto add = [&](double length) {
    if (length > 0 && std::isfinite(length)) lengths.push_back(length);
  };
  for (int32_t i = 0; i < body.particle_count(); ++i) {
    for (const int32_t other : body.neighbours(i)) add(body.rest_length(i, other));
  }
  if (lengths.empty()) {
    // The distance to the nearest particle, of some particles.
    constexpr int32_t kSome = 64;
    for (int32_t i = 0; i < body.particle_count(); i += body.particle_count() / kSome + 1) {
      double nearest = std::numeric_limits<double>::infinity();
      for (const Vec3 other : body.rest) {
        if (const double length = norm(other - body.rest[at(i)]); length > 0) nearest = std::min(nearest, length);
      }
      add(nearest);
    }
  }
  if (lengths.empty()) return 1;
  const auto middle = lengths.begin() + std::ssize(lengths) / 2;
  std::nth_element(lengths.begin(), middle, lengths.end());
  return *middle;
}

RunStates::RunStates(std::function<io::RunSegments()> open, const JudgedRun& judged)
    : open_(std::move(open)), particles_(static_cast<int32_t>(judged.particles_at_end)) {
  rewind();
  if (frames_->next()) make_body();
  rewind();
}

void RunStates::rewind() {
  frames_.emplace(open_());
  state_ = {};
  state_.x.assign(at(particles_), {kNowhere, kNowhere, kNowhere});
  state_.alive.assign(at(particles_), 0);
  at_ = -1;
}

void RunStates::make_body() {
  const oracles::RunHeader& header = frames_->header();
  Body& body = setup_.body;
  body.rest.assign(at(particles_), {kNowhere, kNowhere, kNowhere});
  body.mass.assign(at(particles_), 1);
  const auto positions = frames_->frame().positions.first(std::min(frames_->frame().positions.size(), at(particles_)));
  std::copy(positions.begin(), positions.end(), body.rest.begin());
  put_edges(body, header.edges);
  const oracles::RunCoupling* const coupling = frames_->coupling();
  if (header.edges.empty() && coupling != nullptr && coupling->corners > 0) put_edges(body, edges_of_cells(*coupling));
  body.grid.spacing = header.spacing > 0 ? header.spacing : plausible_spacing(body);
}

const State& RunStates::after(int64_t frame) {
  if (frame < at_) rewind();
  while (at_ < frame) {
    if (!frames_->next()) {
      throw InputError(open_().source(), "", "The run has become shorter since it was judged.",
                       "Do not write the run while it is judged.");
    }
    take();
  }
  return state_;
}

void RunStates::take() {
  const oracles::RunFrame& frame = frames_->frame();
  at_ = frame.index;
  state_.frame = at_ + 1;
  state_.removed.clear();
  for (std::size_t i = 0; i < std::min(frame.positions.size(), state_.x.size()); ++i) {
    const bool is_there = oracles::exists(frame, i);
    if (state_.alive[i] != 0 && !is_there) state_.removed.push_back(static_cast<int32_t>(i));
    state_.alive[i] = is_there ? 1 : 0;
    state_.x[i] = frame.positions[i];
  }
  swept_.assign(frame.blade.begin(), frame.blade.end());
  time_ = frame.time;
  if (frames_->has_new_coupling()) take_coupling();
  state_.skin = frames_->skin().value_or(Skin());
}

void RunStates::take_coupling() {
  const oracles::RunCoupling* const given = frames_->coupling();
  Clusters& groups = state_.clusters;
  groups = {};
  const auto add = [&](std::span<const int32_t> members, std::span<const double> weights) {
    for (std::size_t k = 0; k < members.size(); ++k) {
      const bool is_member =
          members[k] >= 0 && members[k] < particles_ && (weights.empty() || weights[k] > frames_->header().u);
      if (is_member) groups.members.push_back(members[k]);
    }
    groups.number.push_back(groups.count());
    groups.offsets.push_back(std::ssize(groups.members));
  };
  for (std::size_t g = 0; g + 1 < given->offsets.size(); ++g) {
    const int64_t begin = given->offsets[g], end = given->offsets[g + 1];
    if (begin < 0 || end < begin || end > std::ssize(given->members)) break;  // the judge says so
    const auto part = [&](const auto& all) { return std::span(all).subspan(at(begin), at(end - begin)); };
    add(part(given->members), given->weights.empty() ? std::span<const double>() : part(given->weights));
  }
  const auto corners = at(given->corners);
  for (std::size_t first = 0; first < given->cells.size(); first += corners)
    add(std::span(given->cells).subspan(first, corners), {});
}

void PiecesOverTime::add(const std::vector<int32_t>& piece) {
  std::vector<Change>& changes = changes_.emplace_back();
  if (piece.size() > now_.size()) now_.resize(piece.size(), -1);
  for (std::size_t i = 0; i < piece.size(); ++i) {
    if (piece[i] == now_[i]) continue;
    changes.push_back({static_cast<int32_t>(i), piece[i]});
    now_[i] = piece[i];
  }
}

const std::vector<int32_t>& PiecesOverTime::after(int64_t frame, int32_t particles) {
  if (frame < shown_frame_ || std::ssize(shown_) != particles) {
    shown_.assign(at(particles), -1);
    shown_frame_ = -1;
  }
  while (shown_frame_ < std::min(frame, std::ssize(changes_) - 1)) {
    for (const auto& [particle, piece] : changes_[at(++shown_frame_)]) shown_[at(particle)] = piece;
  }
  return shown_;
}

}  // namespace cutproof::harness
