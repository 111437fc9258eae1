#include "baselines/dissection.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <numeric>
#include <stdexcept>

namespace cutproof::baselines {

namespace {

double number(const cutproof_array& array, int64_t k) {
  if (array.type == CUTPROOF_F32) return static_cast<const float*>(array.data)[k];
  return static_cast<const double*>(array.data)[k];
}

std::vector<Vec3> vectors(const cutproof_array& array) {
  std::vector<Vec3> result;
  for (int64_t k = 0; k + 2 < array.rows * array.columns; k += 3)
    result.emplace_back(number(array, k), number(array, k + 1), number(array, k + 2));
  return result;
}

template <std::size_t N>
std::vector<std::array<int32_t, N>> rows(const cutproof_array& array) {
  std::vector<std::array<int32_t, N>> result(static_cast<std::size_t>(array.rows));
  if (!result.empty()) std::memcpy(result.data(), array.data, result.size() * sizeof result[0]);
  return result;
}

// Appends rows to outputs, whose room doubles.
class Output {
 public:
  Output(const cutproof_host* host, cutproof_array* array) : host_(host), array_(array) {}
  // `values`: any number of whole rows.
  template <class T>
  void add(const T* values, std::size_t count) {
    if (array_ == nullptr || count == 0) return;
    const int64_t rows = static_cast<int64_t>(count) / array_->columns, first = used_;
    used_ += rows;
    if (used_ > array_->rows && host_->grow(host_, array_, std::max(used_, 2 * array_->rows)) != 0)
      throw std::bad_alloc();
    const auto put = [&](auto* data) {
      data += first * array_->columns;
      for (std::size_t k = 0; k < count; ++k)
        data[k] = static_cast<std::remove_reference_t<decltype(*data)>>(values[k]);
    };
    switch (array_->type) {
      case CUTPROOF_I32:
        return put(static_cast<int32_t*>(array_->data));
      case CUTPROOF_I64:
        return put(static_cast<int64_t*>(array_->data));
      case CUTPROOF_U8:
        return put(static_cast<uint8_t*>(array_->data));
      case CUTPROOF_F32:
        return put(static_cast<float*>(array_->data));
      case CUTPROOF_F64:
        return put(static_cast<double*>(array_->data));
      default:
        throw std::logic_error("an output has a type that there is not");
    }
  }
  template <class T>
  void add(const std::vector<T>& values) {
    add(values.data(), values.size());
  }
  void add(const std::vector<Vec3>& values) { add(values.empty() ? nullptr : values[0].data(), 3 * values.size()); }
  template <class T, std::size_t N>
  void add(const std::vector<std::array<T, N>>& values) {
    add(values.empty() ? nullptr : values[0].data(), N * values.size());
  }
  template <class T>
  void add_one(T value) {
    add(&value, 1);
  }
  bool is_empty() const { return used_ == 0; }
  // Takes back the room that was not used.
  void end() {
    if (array_ != nullptr && array_->rows > used_ && host_->grow(host_, array_, used_) != 0) throw std::bad_alloc();
  }

 private:
  const cutproof_host* host_;
  cutproof_array* array_;
  int64_t used_ = 0;
};

}  // namespace

Scene scene_of(const cutproof_scene& asked) {
  const cutproof_tissue& tissue = *asked.tissue;
  Scene scene;
  scene.spacing = tissue.spacing;
  scene.rest = vectors(*tissue.rest);
  scene.velocity = vectors(*asked.velocity);
  scene.kick = vectors(*asked.kick);
  scene.kick_frame = asked.kick_frame;
  const std::size_t n = scene.rest.size();
  for (std::size_t i = 0; i < n; ++i) scene.mass.push_back(number(*tissue.mass, static_cast<int64_t>(i)));
  const auto* held = static_cast<const uint8_t*>(asked.held->data);
  scene.held.assign(held, held + n);
  scene.node = rows<3>(*tissue.node);
  scene.tetrahedra = rows<4>(*asked.tetrahedra);
  scene.hexahedra = rows<8>(*asked.hexahedra);
  const auto* offsets = static_cast<const int64_t*>(tissue.edge_offsets->data);
  const auto* ends = static_cast<const int32_t*>(tissue.edge_ends->data);
  for (int32_t i = 0; i < static_cast<int32_t>(n); ++i) {
    for (int64_t k = offsets[i]; k < offsets[i + 1]; ++k) {
      if (ends[k] > i) scene.edges.push_back({i, ends[k]});
    }
  }
  scene.gravity = Vec3(asked.gravity[0], asked.gravity[1], asked.gravity[2]);
  scene.frame_time = asked.frame_time;
  const std::vector<Vec3> corners = vectors(*asked.blade);
  scene.blade.resize(static_cast<std::size_t>(asked.frames));
  for (std::size_t k = 0; k + 3 < corners.size(); k += 4) {
    const Patch patch = {corners[k], corners[k + 1], corners[k + 2], corners[k + 3]};
    if (std::all_of(patch.begin(), patch.end(), [](const Vec3& x) { return x.allFinite(); }))
      scene.blade[k / 4 / static_cast<std::size_t>(asked.blades)].push_back(patch);
  }
  return scene;
}

Parameters::Parameters(const char* text, std::map<std::string, double> known) : values_(std::move(known)) {
  std::string names;
  for (const auto& [name, value] : values_) names += (names.empty() ? "" : ", ") + name;
  const std::string all = text == nullptr ? "" : text;
  for (std::size_t begin = 0; begin < all.size();) {
    const std::size_t end = std::min(all.find(',', begin), all.size()), equals = all.find('=', begin);
    const std::string word = all.substr(begin, end - begin);
    const auto found = equals < end ? values_.find(all.substr(begin, equals - begin)) : values_.end();
    if (found == values_.end())
      throw std::invalid_argument("there is no parameter '" + word + "'; give NAME=NUMBER of " + names);
    const std::string number = all.substr(equals + 1, end - equals - 1);
    char* after = nullptr;
    found->second = std::strtod(number.c_str(), &after);
    if (number.empty() || *after != '\0' || !std::isfinite(found->second))
      throw std::invalid_argument("parameter '" + word + "' has no finite number; give NAME=NUMBER of " + names);
    begin = end + 1;
  }
}

int dissect(Simulator& simulator, const Scene& scene, const cutproof_host* host, cutproof_frames* run) {
  const auto output = [&](cutproof_array* array) { return Output(host, array); };
  Output particles = output(run->particles), position = output(run->position), velocity = output(run->velocity),
         spin = output(run->spin), mass = output(run->mass), alive = output(run->alive), parent = output(run->parent),
         contact_impulse = output(run->contact_impulse), group_count = output(run->group_count),
         offsets = output(run->offsets), members = output(run->members), weights = output(run->weights),
         cell_count = output(run->cell_count), tetrahedra = output(run->tetrahedra), hexahedra = output(run->hexahedra),
         steps = output(run->steps), damping = output(run->damping),
         seconds = output(CUTPROOF_HAS(run, seconds) ? run->seconds : nullptr);
  bool any_groups = false, any_cells = false;
  int64_t grouped = 0;
  try {
    steps.add_one(simulator.substeps());
    if (simulator.damping() > 0) damping.add_one(simulator.damping());
    for (std::size_t f = 0; f < scene.blade.size(); ++f) {
      const auto begin = std::chrono::steady_clock::now();
      if (f > 0) {
        if (static_cast<int>(f) == scene.kick_frame) simulator.kick(scene.kick);
        simulator.advance(scene.frame_time);
      }
      if (!scene.blade[f].empty()) simulator.cut(scene.blade[f]);
      simulator.finish();
      seconds.add_one(std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());

      const Frame frame = simulator.frame(f == 0 || !scene.blade[f].empty());
      particles.add_one(static_cast<int32_t>(frame.position.size()));
      position.add(frame.position);
      velocity.add(frame.velocity);
      spin.add(frame.spin);
      mass.add(frame.mass);
      alive.add(frame.alive);
      parent.add(frame.parent);
      if (frame.contact_impulse) contact_impulse.add(frame.contact_impulse->data(), 3);
      any_groups = any_groups || frame.has_groups;
      any_cells = any_cells || frame.has_cells;
      if (any_groups) group_count.add_one(frame.has_groups ? static_cast<int32_t>(frame.offsets.size() - 1) : -1);
      if (frame.has_groups) {
        // One list for all frames.
        if (offsets.is_empty()) offsets.add_one(int64_t{0});
        for (std::size_t g = 1; g < frame.offsets.size(); ++g) offsets.add_one(grouped + frame.offsets[g]);
        grouped += frame.offsets.back();
        members.add(frame.members);
        weights.add(frame.weights);
      }
      if (any_cells) {
        const std::size_t cells = frame.tetrahedra.size() + frame.hexahedra.size();
        cell_count.add_one(frame.has_cells ? static_cast<int32_t>(cells) : -1);
      }
      tetrahedra.add(frame.tetrahedra);
      hexahedra.add(frame.hexahedra);
    }
    for (Output* each :
         {&particles, &position, &velocity, &spin, &mass, &alive, &parent, &contact_impulse, &group_count, &offsets,
          &members, &weights, &cell_count, &tetrahedra, &hexahedra, &steps, &damping, &seconds})
      each->end();
  } catch (const std::bad_alloc&) {
    return 1;
  }
  return 0;
}

namespace {

// Whether the segment crosses the triangle. Sides of the segment's line are told by signed volumes.
bool crosses(const Vec3& p, const Vec3& q, const Vec3& r, const Vec3& a, const Vec3& b) {
  const Vec3 normal = (q - p).cross(r - p);
  const double da = (a - p).dot(normal), db = (b - p).dot(normal);
  if ((da >= 0) == (db >= 0)) return false;
  const Vec3 at = a + da / (da - db) * (b - a);
  const auto inside = [&](const Vec3& from, const Vec3& to) { return (to - from).cross(at - from).dot(normal) >= 0; };
  return inside(p, q) && inside(q, r) && inside(r, p);
}

}  // namespace

bool crosses(const Patch& patch, const Vec3& a, const Vec3& b) {
  return crosses(patch[0], patch[1], patch[2], a, b) || crosses(patch[0], patch[2], patch[3], a, b);
}

std::vector<int32_t> components(int32_t count, const std::vector<std::array<int32_t, 2>>& pairs) {
  std::vector<int32_t> root(static_cast<std::size_t>(count));
  std::iota(root.begin(), root.end(), 0);
  const auto find = [&](int32_t i) {
    while (root[static_cast<std::size_t>(i)] != i) {
      int32_t& up = root[static_cast<std::size_t>(i)];
      i = up = root[static_cast<std::size_t>(up)];
    }
    return i;
  };
  for (const auto& [a, b] : pairs) {
    const int32_t one = find(a), other = find(b);
    root[static_cast<std::size_t>(std::max(one, other))] = std::min(one, other);
  }
  std::vector<int32_t> number(root.size(), -1);
  int32_t next = 0;
  for (int32_t i = 0; i < count; ++i) {
    int32_t& of_root = number[static_cast<std::size_t>(find(i))];
    if (of_root < 0) of_root = next++;
    number[static_cast<std::size_t>(i)] = of_root;
  }
  return number;
}

}  // namespace cutproof::baselines
