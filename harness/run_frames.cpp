#include "harness/run_frames.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "model/at.h"
#include "model/error.h"
#include "model/io/limits.h"
#include "model/words.h"

namespace cutproof::harness {

namespace {

constexpr int64_t kMost = std::numeric_limits<int32_t>::max();

uint32_t promises_of(const NamedArrays& in, const std::string& text) {
  uint32_t bits = 0;
  for (const std::string_view word : words_in(text)) {
    const auto found = std::find(oracles::kRunPromises.begin(), oracles::kRunPromises.end(), word);
    if (found == oracles::kRunPromises.end()) {
      in.refuse("promises", fmt::format("A run cannot promise '{}'.", word),
                fmt::format("Use {}.", fmt::join(oracles::kRunPromises, ", ")));
    }
    bits |= 1u << (found - oracles::kRunPromises.begin());
  }
  return bits;
}

}  // namespace

const std::vector<KnownArray>& run_arrays() {
  static const std::vector<KnownArray> known = {
      {"rest", "rest positions of particles [m]"},
      {"mass", "masses of particles [kg]"},
      {"gravity", "[m/s²]"},
      {"spacing", "h [m]"},
      {"steps", "substeps in a frame"},
      {"damping", "c [1/s]: velocities decay as exp(-c t)"},
      {"edges", "pairs of particles that are tissue"},
      {"nodes", "integer coordinates at rest"},
      {"cut_resolution", "greatest distance of a cut from the sweep [m]"},
      {"unit_roundoff", "unit roundoff of the simulator's arithmetic"},
      {"positions", "positions of particles, frame by frame [m]"},
      {"time", "time of each frame [s]"},
      {"velocities", "[m/s]"},
      {"alive", "frame by frame, 1: the particle exists"},
      {"held", "frame by frame, 1: its motion is prescribed"},
      {"removed", "frame by frame, 1: a cut has removed the particle"},
      {"contact_impulse", "impulse of each frame [kg m/s]"},
      {"spin", "angular momentum that particles carry [kg m²/s]"},
      {"energy", "energy of each frame [J]"},
      {"blade", "patches that the blade sweeps in each frame"},
      {"groups_offsets", "where each coupling group begins"},
      {"groups_members", "particles of coupling groups, group by group"},
      {"groups_weights", "weight of each member"},
      {"cells", "corners of tetrahedra or hexahedra"},
      {"parent", "parent of each particle that was split off"},
      {"piece", "pieces according to the simulator"},
      {"permutation", "corresponding particle of a related run"},
      {"vertices", "vertices of the skin [m]"},
      {"triangles", "triangles of the skin"},
  };
  return known;
}

const std::vector<KnownArray>& run_texts() {
  static const std::vector<KnownArray> known = {{"promises", "promises of the run, by name"}};
  return known;
}

RunSegment::RunSegment(io::ArrayFile contents, std::string file, int64_t frame)
    : contents_(std::move(contents)),
      file_(std::move(file)),
      in_(contents_, file_, run_arrays(), run_texts()),
      first_(frame) {
  const Array& positions = in_.require_either("positions", {-1, -1, 3}, {-1, 3});
  if (positions.count() == 0)
    in_.refuse("positions", "There are no frames, or no particles.", "Write at least one of both.");
  is_one_ = positions.shape.size() == 2;
  frames_ = is_one_ ? 1 : positions.shape[0];
  particles_ = positions.shape[is_one_ ? 0 : 1];
  if (particles_ > kMost)
    in_.refuse("positions", "There are more particles than 32-bit numbers can name.", "Write fewer.");
  precision_ = precision_of(positions);
  positions_ = in_.vectors(positions);
  velocities_ = vectors("velocities", particles_);
  spin_ = vectors("spin", particles_);
  alive_ = flags("alive");
  held_ = flags("held");
  removed_ = flags("removed");
  impulse_ = vectors("contact_impulse", 0);
  time_ = numbers("time");
  energy_ = numbers("energy");
  blade_ = quads();
  if (const Array* const parent = in_.find("parent", {particles_})) parent_ = in_.integers(*parent);
  if (const Array* const piece = in_.find("piece", {particles_})) piece_ = in_.integers(*piece);
  if (const Array* const vertices = find("vertices", {-1, 3})) vertices_ = in_.vectors(*vertices);
  if (const Array* const triangles = in_.find("triangles", {-1, 3})) {
    if (!has_vertices()) in_.refuse("triangles", "There are no vertices.", "Write vertices of each frame.");
    const std::vector<int32_t> corners = in_.integers(*triangles);
    triangles_.emplace();
    for (std::size_t k = 0; k < corners.size(); k += 3)
      triangles_->push_back({corners[k], corners[k + 1], corners[k + 2]});
  }
}

oracles::RunFrame RunSegment::frame(int64_t k) const {
  oracles::RunFrame made;
  made.index = first_ + k;
  const auto part = [&](const auto& all) { return of_frame(all, k); };
  made.positions = part(positions_);
  made.velocities = part(velocities_);
  made.spin = part(spin_);
  made.alive = part(alive_);
  made.held = part(held_);
  made.removed = part(removed_);
  // A frame in which the blade sweeps nothing has none.
  made.blade = part(blade_);
  if (std::ranges::all_of(made.blade, oracles::is_blank)) made.blade = {};
  made.parent = parent_;
  if (k == 0) made.piece = piece_;
  if (!impulse_.empty()) made.contact_impulse = impulse_[at(k)];
  if (!time_.empty()) made.time = time_[at(k)];
  if (!energy_.empty()) made.energy = energy_[at(k)];
  return made;
}

// Of an array with an entry for each frame, and in that `inner` more unless it is 0.
const Array* RunSegment::find(std::string_view name, std::vector<int64_t> inner) const {
  if (!in_.has(name)) return nullptr;
  std::vector<int64_t> by_frame = inner;
  by_frame.insert(by_frame.begin(), frames_);
  return &(is_one_ ? in_.require_either(name, by_frame, inner) : in_.require(name, by_frame));
}
std::vector<Vec3> RunSegment::vectors(std::string_view name, int64_t inner) const {
  const Array* const found = find(name, inner == 0 ? std::vector<int64_t>{3} : std::vector<int64_t>{inner, 3});
  return found == nullptr ? std::vector<Vec3>{} : in_.vectors(*found);
}
std::vector<double> RunSegment::numbers(std::string_view name) const {
  const Array* const found = find(name, {});
  return found == nullptr ? std::vector<double>{} : in_.numbers(*found);
}
std::vector<uint8_t> RunSegment::flags(std::string_view name) const {
  const Array* const found = find(name, {particles_});
  std::vector<uint8_t> made;
  if (found == nullptr) return made;
  in_.require_whole(*found);
  made.resize(at(found->count()));
  for (std::size_t k = 0; k < made.size(); ++k) {
    const int64_t flag = found->integer(static_cast<int64_t>(k));
    if (flag != 0 && flag != 1) in_.refuse(name, fmt::format("It holds {}.", flag), "Write 1 or 0.");
    made[k] = static_cast<uint8_t>(flag);
  }
  return made;
}
std::vector<Vec3> RunSegment::quads() const {
  std::vector<Vec3> made;
  if (!in_.has("blade")) return made;
  const Array& blade = is_one_ ? in_.require_either("blade", {frames_, -1, -1, 3}, {-1, -1, 3})
                               : in_.require("blade", {frames_, -1, -1, 3});
  const std::size_t each = at(blade.shape[blade.shape.size() - 2]);
  if (each != 3 && each != 4)
    in_.refuse("blade", fmt::format("Its patches have {} corners.", each), "Write triangles or quads.");
  const int64_t patches = blade.count() / (frames_ * static_cast<int64_t>(each) * 3);
  if (patches > io::kMostPatches)
    in_.refuse("blade", fmt::format("It has {} patches in a frame, more than {}.", patches, io::kMostPatches),
               "Write a coarser sweep.");
  const std::vector<Vec3> corners = in_.vectors(blade);
  for (std::size_t k = 0; k + each <= corners.size(); k += each) {
    for (std::size_t c = 0; c < 4; ++c) made.push_back(corners[k + std::min(c, each - 1)]);
  }
  return made;
}
template <class T>
std::span<const T> RunSegment::of_frame(const std::vector<T>& all, int64_t k) const {
  const std::size_t each = all.size() / at(frames_);
  return std::span<const T>(all).subspan(at(k) * each, each);
}

double RunSegment::positive(std::string_view name, double otherwise, bool may_be_zero) const {
  const std::optional<double> given = in_.number(name);
  if (given && !((may_be_zero ? *given >= 0 : *given > 0) && std::isfinite(*given))) {
    in_.refuse(name, fmt::format("It is {}.", *given),
               may_be_zero ? "Write 0 or more, finite." : "Write more than 0, finite.");
  }
  return given.value_or(otherwise);
}

oracles::RunHeader RunSegment::header() const {
  oracles::RunHeader header;
  const int64_t n = particles_;
  if (const Array* const rest = in_.find("rest", {n, 3})) header.rest = in_.vectors(*rest);
  if (const Array* const gravity = in_.find("gravity", {3})) {
    header.gravity = in_.vectors(*gravity).front();
    if (!is_finite(*header.gravity))
      in_.refuse("gravity", "It contains a value that is not a number.", "Write m/s², or leave it out.");
  }
  if (const Array* const edges = in_.find("edges", {-1, 2})) {
    const std::vector<int32_t> ends = in_.integers(*edges);
    for (std::size_t k = 0; k < ends.size(); k += 2) header.edges.push_back({ends[k], ends[k + 1]});
  }
  header.spacing = positive("spacing", 0, false);
  header.damping = positive("damping", 0, true);
  header.cut_resolution = positive("cut_resolution", 0, true);
  header.u = positive("unit_roundoff", unit_roundoff(precision_), false);
  if (header.u > 0x1p-12) {
    in_.refuse("unit_roundoff", fmt::format("It is {}. Half precision has too few digits to be judged.", header.u),
               "Write the unit roundoff of the arithmetic: 6e-8 in single precision.");
  }
  header.steps = in_.whole_number("steps").value_or(1);
  if (header.steps < 1) in_.refuse("steps", fmt::format("It is {}.", header.steps), "Write the substeps in a frame.");
  if (const Array* const nodes = in_.find("nodes", {n, 3})) {
    header.spacing = header.spacing > 0 ? header.spacing : 1;
    if (header.rest.empty()) {
      const std::vector<double> coordinates = in_.numbers(*nodes);
      for (std::size_t k = 0; k < coordinates.size(); k += 3) {
        header.rest.push_back(header.spacing * Vec3{coordinates[k], coordinates[k + 1], coordinates[k + 2]});
      }
    }
  }
  if (const std::string* const promises = find_text(contents_, "promises"))
    header.promises = promises_of(in_, *promises);
  return header;
}

std::optional<oracles::RunCoupling> RunSegment::coupling() const {
  if (!in_.has("groups_offsets") && !in_.has("groups_members") && !in_.has("cells")) return std::nullopt;
  oracles::RunCoupling coupling;
  if (in_.both("groups_offsets", "groups_members")) {
    coupling.offsets = in_.long_integers(in_.require("groups_offsets", {-1}));
    if (coupling.offsets.empty())
      in_.refuse("groups_offsets", "It is empty.",
                 "Write where each group begins, and the number of all members; at least 0.");
    coupling.members = in_.integers(in_.require("groups_members", {-1}));
    const auto members = std::ssize(coupling.members);
    if (const Array* const weights = in_.find("groups_weights", {members})) coupling.weights = in_.numbers(*weights);
  }
  if (in_.has("cells")) {
    const Array& cells = in_.require("cells", {-1, -1});
    coupling.corners = static_cast<int>(std::min<int64_t>(cells.shape.back(), 9));
    if (coupling.corners != 4 && coupling.corners != 8) {
      in_.refuse("cells", fmt::format("They have {} corners.", cells.shape.back()), "Write tetrahedra or hexahedra.");
    }
    coupling.cells = in_.integers(cells);
  }
  return coupling;
}

std::vector<double> RunSegment::mass() const {
  const Array* const found = in_.find("mass", {particles_});
  if (found == nullptr) return {};
  std::vector<double> masses = in_.numbers(*found);
  for (const double m : masses) {
    if (!(m > 0 && std::isfinite(m)))
      in_.refuse("mass", fmt::format("It holds {}.", m), "Write masses above 0, in kg.");
  }
  return masses;
}

std::span<const Vec3> RunSegment::vertices(int64_t k) const { return of_frame(vertices_, k); }

void RunSegment::refuse_what_is_given_once() const {
  for (const std::string_view name : {"rest", "gravity", "spacing", "steps", "damping", "edges", "nodes",
                                      "cut_resolution", "unit_roundoff", "permutation", "promises"}) {
    if (in_.has(name) || find_text(contents_, name) != nullptr)
      in_.refuse(name, "It is given once in a run, and this is a later segment.", "Write it into the first one only.");
  }
}

bool RunFrames::next() {
  if (!segment_ || ++in_segment_ == segment_->frames()) {
    before_ += segment_ ? segment_->frames() : 0;
    in_segment_ = 0;
    segment_.reset();  // before the next one is read: two need not fit into memory
    std::optional<io::ArrayFile> contents = segments_.next();
    if (!contents) {
      if (begun_ == 0) throw InputError(segments_.source(), "", "It has no frame.", "Write at least one.");
      return false;
    }
    segment_ = std::make_unique<RunSegment>(std::move(*contents), segments_.source(), before_);
    if (begun_++ == 0) {
      header_ = segment_->header();
    } else {
      segment_->refuse_what_is_given_once();
    }
    if (segment_->triangles()) triangles_ = segment_->triangles();
    std::optional<oracles::RunCoupling> coupling = segment_->coupling();
    is_new_coupling_ = coupling.has_value();
    if (coupling) renew(std::move(*coupling));
    if (segment_->has_vertices() && !triangles_)
      segment_->arrays().refuse("vertices", "There are no triangles.", "Write triangles, too.");
  }
  frame_ = segment_->frame(in_segment_);
  return true;
}

void RunFrames::renew(oracles::RunCoupling given) {
  if (coupling_ && given.corners == 0) {
    given.cells = std::move(coupling_->cells);
    given.corners = coupling_->corners;
  }
  if (coupling_ && given.offsets.empty()) {
    given.offsets = std::move(coupling_->offsets);
    given.members = std::move(coupling_->members);
    given.weights = std::move(coupling_->weights);
  }
  coupling_ = std::move(given);
}

std::optional<Skin> RunFrames::skin() const {
  if (!segment_->has_vertices()) return std::nullopt;
  Skin skin;
  const std::span<const Vec3> places = skin_places();
  skin.position.assign(places.begin(), places.end());
  skin.triangles = *triangles_;
  return skin;
}

}  // namespace cutproof::harness
