// The reference as a plugin: all operations, right unless the parameters name a stage or an operation to spoil. It
// knows its body, its setup and its state through cutproof/plugin.h alone. As "plain" and "from the first" it sums rest
// frames and skin itself, in the arithmetic of its numbers, as a kernel would.
#include "reference_kernels.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "model/at.h"
#include "model/fields.h"
#include "model/setup_fields.h"
#include "reference_cpu/reference.h"
#include "surface_nets.h"

namespace reference_plugin {

using namespace cutproof;

using Real = std::conditional_t<PLUGIN_REAL == CUTPROOF_F32, float, double>;

template <class T>
inline constexpr bool is_vector = false;
template <class T>
inline constexpr bool is_vector<std::vector<T>> = true;

double number(const cutproof_array* array, int64_t k) {
  switch (array->type) {
    case CUTPROOF_I32:
      return static_cast<const int32_t*>(array->data)[k];
    case CUTPROOF_I64:
      return static_cast<double>(static_cast<const int64_t*>(array->data)[k]);
    case CUTPROOF_U8:
      return static_cast<const uint8_t*>(array->data)[k];
    case CUTPROOF_F32:
      return static_cast<double>(static_cast<const float*>(array->data)[k]);
    default:
      return static_cast<const double*>(array->data)[k];
  }
}
void set(cutproof_array* array, int64_t k, double value) {
  switch (array->type) {
    case CUTPROOF_I32:
      static_cast<int32_t*>(array->data)[k] = static_cast<int32_t>(value);
      break;
    case CUTPROOF_I64:
      static_cast<int64_t*>(array->data)[k] = static_cast<int64_t>(value);
      break;
    case CUTPROOF_U8:
      static_cast<uint8_t*>(array->data)[k] = static_cast<uint8_t>(value);
      break;
    case CUTPROOF_F32:
      static_cast<float*>(array->data)[k] = static_cast<float>(value);
      break;
    default:
      static_cast<double*>(array->data)[k] = value;
  }
}

// One entry of a field, from row `row`, and back.
template <class T>
void get_row(const cutproof_array* array, int64_t row, T& value) {
  if constexpr (std::is_same_v<T, Vec3>) {
    value = {number(array, 3 * row), number(array, 3 * row + 1), number(array, 3 * row + 2)};
  } else if constexpr (std::is_same_v<T, Mat3>) {
    for (int64_t k = 0; k < 9; ++k) value.m[at(k)] = number(array, 9 * row + k);
  } else if constexpr (std::is_same_v<T, std::array<int32_t, 3>>) {
    for (int64_t k = 0; k < 3; ++k) value[at(k)] = static_cast<int32_t>(number(array, 3 * row + k));
  } else if constexpr (std::is_same_v<T, bool>) {
    value = number(array, row) != 0;
  } else {
    value = static_cast<T>(number(array, row));
  }
}
template <class T>
void set_row(cutproof_array* array, int64_t row, const T& value) {
  if constexpr (std::is_same_v<T, Vec3>) {
    for (int k = 0; k < 3; ++k) set(array, 3 * row + k, value[k]);
  } else if constexpr (std::is_same_v<T, Mat3>) {
    for (int64_t k = 0; k < 9; ++k) set(array, 9 * row + k, value.m[at(k)]);
  } else if constexpr (std::is_same_v<T, std::array<int32_t, 3>>) {
    for (int64_t k = 0; k < 3; ++k) set(array, 3 * row + k, value[at(k)]);
  } else {
    set(array, row, static_cast<double>(value));
  }
}

cutproof_array* member(const cutproof_state* state, std::string_view name) {
#define MEMBER(member) \
  if (name == #member) return state->member
  MEMBER(frame);
  MEMBER(tau);
  MEMBER(cap);
  MEMBER(edge_covered);
  MEMBER(impulse);
  MEMBER(position);
  MEMBER(velocity);
  MEMBER(alive);
  MEMBER(removed);
  MEMBER(debris);
  MEMBER(offsets);
  MEMBER(members);
  MEMBER(number);
  MEMBER(rest_center);
  MEMBER(mass);
  MEMBER(rotation);
  MEMBER(degenerate);
  MEMBER(owner);
  MEMBER(direction);
  MEMBER(skin_position);
  MEMBER(triangles);
  MEMBER(reach);
#undef MEMBER
  return nullptr;
}

State state_of(const cutproof_state* from) {
  State state;
  for_each_field([&](const Field& field, auto get) {
    auto& to = get(state);
    using T = std::remove_cvref_t<decltype(to)>;
    const cutproof_array* const array = member(from, field.name);
    if constexpr (is_vector<T>) {
      to.resize(at(array->rows));
      for (int64_t row = 0; row < array->rows; ++row) get_row(array, row, to[at(row)]);
    } else {
      get_row(array, 0, to);
    }
  });
  return state;
}

// But for the field `kept_back`.
bool give(const cutproof_host* host, const State& state, cutproof_state* to, std::string_view kept_back) {
  bool had = true;
  for_each_field([&](const Field& field, auto get) {
    if (field.name == kept_back) return;
    const auto& from = get(state);
    using T = std::remove_cvref_t<decltype(from)>;
    cutproof_array* const array = member(to, field.name);
    if constexpr (is_vector<T>) {
      if (host->grow(host, array, static_cast<int64_t>(from.size())) != 0) had = false;
      for (std::size_t row = 0; had && row < from.size(); ++row) set_row(array, static_cast<int64_t>(row), from[row]);
    } else {
      set_row(array, 0, from);
    }
  });
  return had;
}

// One field of one entry, or of the setup.
template <class T>
void get_all(const cutproof_host* host, const std::string& name, T& to) {
  const cutproof_array* const array = host->setup(host, name.c_str());
  if (array == nullptr) return;
  if constexpr (is_vector<T>) {
    to.resize(at(array->rows));
    for (int64_t row = 0; row < array->rows; ++row) get_row(array, row, to[at(row)]);
  } else if constexpr (std::is_same_v<T, std::string>) {
    to.clear();
  } else if constexpr (!std::is_same_v<T, std::array<int32_t, 3>>) {
    get_row(array, 0, to);
  }
}

template <class Entry>
void get_entries(const cutproof_host* host, std::vector<Entry>& entries) {
  for_each_entry_field<Entry>([&](const SetupField& field, auto get) {
    using T = std::remove_cvref_t<decltype(get(entries[0]))>;
    const std::string name = std::string(field.group) + "/" + std::string(field.name);
    const cutproof_array* const array = host->setup(host, name.c_str());
    if constexpr (is_vector<T>) {
      const cutproof_array* const offsets = host->setup(host, (name + "_offsets").c_str());
      entries.resize(at(offsets->rows - 1));
      for (std::size_t e = 0; e < entries.size(); ++e) {
        T& list = get(entries[e]);
        list.clear();
        for (auto k = static_cast<int64_t>(number(offsets, static_cast<int64_t>(e)));
             k < static_cast<int64_t>(number(offsets, static_cast<int64_t>(e) + 1)); ++k) {
          get_row(array, k, list.emplace_back());
        }
      }
    } else {
      entries.resize(at(array->rows));
      for (std::size_t e = 0; e < entries.size(); ++e) get_row(array, static_cast<int64_t>(e), get(entries[e]));
    }
  });
}

Body body_of(const cutproof_tissue* tissue) {
  Body body;
  const int64_t n = tissue->mass->rows;
  body.grid.spacing = tissue->spacing;
  for (int64_t i = 0; i < n; ++i) body.mass.push_back(number(tissue->mass, i));
  if (tissue->node != nullptr) {
    for (std::size_t axis = 0; axis < 3; ++axis) body.grid.nodes[axis] = tissue->nodes[axis];
    body.particle_at.assign(at(body.grid.node_count()), -1);
    for (int64_t i = 0; i < n; ++i) {
      const auto of = [&](int64_t axis) { return static_cast<int32_t>(number(tissue->node, 3 * i + axis)); };
      body.node.push_back(body.grid.index(of(0), of(1), of(2)));
      body.particle_at[at(body.node.back())] = static_cast<int32_t>(i);
    }
    return body;
  }
  for (int64_t i = 0; i < n; ++i) get_row(tissue->rest, i, body.rest.emplace_back());
  for (int64_t i = 0; i <= n; ++i) body.edge_offsets.push_back(static_cast<int64_t>(number(tissue->edge_offsets, i)));
  for (int64_t k = 0; k < tissue->edge_ends->rows; ++k) {
    body.edge_ends.push_back(static_cast<int32_t>(number(tissue->edge_ends, k)));
  }
  return body;
}

struct Instance {
  std::string spoiled;
  Setup setup;
  std::unique_ptr<Backend> reference = reference::make_backend();
};

void* create(const cutproof_host*, const char* parameters) {
  auto instance = std::make_unique<Instance>();
  instance->spoiled = parameters != nullptr ? parameters : "";
  return instance.release();
}
void destroy(void* self) { delete static_cast<Instance*>(self); }

int load(const cutproof_host* host, void* self, const cutproof_tissue* tissue, const cutproof_state*) {
  Setup& setup = static_cast<Instance*>(self)->setup;
  setup = {};
  setup.body = body_of(tissue);
  if (static_cast<Instance*>(self)->spoiled == "refuse" && setup.body.mass.size() % 2 == 1) return 9;
  for_each_setup_field([&](const SetupField& field, auto get) {
    using T = std::remove_cvref_t<decltype(get(setup))>;
    if (field.group == "body" && field.name != "surface_crossing") return;  // the tissue has the others
    if constexpr (is_list_of_entries<T>) {
      get_entries(host, get(setup));
    } else {
      const std::string name =
          field.group.empty() ? std::string(field.name) : std::string(field.group) + "/" + std::string(field.name);
      get_all(host, name, get(setup));
    }
  });
  return 0;
}

// --- Sums of its own -------------------------------------------------------------------------------------------------

using Sum = std::array<Real, 3>;
Sum real(Vec3 v) { return {static_cast<Real>(v.x), static_cast<Real>(v.y), static_cast<Real>(v.z)}; }
Vec3 wide(const Sum& s) { return {s[0], s[1], s[2]}; }

// The weighted mean of the members' places, in the order of the members: of the coordinates themselves, or of how far
// they are from the first member's.
template <class Place>
std::pair<Sum, Real> mean_of(std::span<const int32_t> members, const std::vector<Real>& weight, const Place& place,
                             bool from_first) {
  const Sum origin = from_first ? place(members.front()) : Sum{};
  Real mass = 0;
  Sum sum = {};
  for (const int32_t i : members) {
    const Sum there = place(i);
    mass += weight[at(i)];
    for (std::size_t axis = 0; axis < 3; ++axis) sum[axis] += weight[at(i)] * (there[axis] - origin[axis]);
  }
  for (std::size_t axis = 0; axis < 3; ++axis) sum[axis] = origin[axis] + sum[axis] / mass;
  return {sum, mass};
}

// Of each particle its mass over the number of its clusters. `whole`: wrong, as if each lay in one.
std::vector<Real> weights_of(const Body& body, const Clusters& clusters, bool whole) {
  std::vector<Real> count(body.mass.size(), 0), weight;
  for (const int32_t i : clusters.members) count[at(i)] += 1;
  for (std::size_t i = 0; i < count.size(); ++i) {
    weight.push_back(static_cast<Real>(body.mass[i]) / (whole ? 1 : count[i]));
  }
  return weight;
}

void sum_rest_frames(const Body& body, const std::string& how, Clusters& clusters) {
  const std::vector<Real> weight = weights_of(body, clusters, how == "whole masses");
  const auto place = [&](int32_t i) { return real(body.rest_position(i)); };
  for (int32_t c = 0; c < clusters.count(); ++c) {
    const auto [center, mass] = mean_of(clusters.of(c), weight, place, how == "from the first");
    clusters.mass[at(c)] = mass;
    // Of one particle it is what was given, to the bit.
    clusters.rest_center[at(c)] = wide(clusters.size(c) == 1 ? place(clusters.of(c).front()) : center);
  }
}

// The maps by which a cluster carries points, from sums of coordinates of its own.
reference::ClusterMaps maps_of(const Setup& setup, const Clusters& clusters, int32_t c, const std::vector<Real>& weight,
                               const std::vector<Vec3>& x, const Sum& center) {
  const Mat3& rotation = clusters.rotation[at(c)];
  if (setup.step.volume_share == 0 || clusters.size(c) == 1) return {rotation, rotation};
  const Sum at_rest = real(clusters.rest_center[at(c)]);
  std::array<Real, 9> a = {}, a0 = {};
  for (const int32_t i : clusters.of(c)) {
    const Sum now = real(x[at(i)]), rest = real(setup.body.rest_position(i));
    for (std::size_t row = 0; row < 3; ++row) {
      for (std::size_t k = 0; k < 3; ++k) {
        const Real arm = weight[at(i)] * (rest[k] - at_rest[k]);
        a[3 * row + k] += (now[row] - center[row]) * arm;
        a0[3 * row + k] += (rest[row] - at_rest[row]) * arm;
      }
    }
  }
  Mat3 moment, moment_at_rest;
  std::copy(a.begin(), a.end(), moment.m.begin());
  std::copy(a0.begin(), a0.end(), moment_at_rest.m.begin());
  return reference::cluster_maps(setup.step.volume_share, moment, moment_at_rest, rotation);
}

void sum_skin(const Setup& setup, const std::string& how, State& state) {
  const Body& body = setup.body;
  const Clusters& clusters = state.clusters;
  const std::vector<Real> weight = weights_of(body, clusters, false);
  std::vector<Sum> center;
  std::vector<reference::ClusterMaps> maps;
  std::vector<std::vector<int32_t>> holders(body.mass.size());
  for (int32_t c = 0; c < clusters.count(); ++c) {
    center.push_back(
        mean_of(
            clusters.of(c), weight, [&](int32_t i) { return real(state.x[at(i)]); }, how == "from the first")
            .first);
    maps.push_back(maps_of(setup, clusters, c, weight, state.x, center.back()));
    for (const int32_t i : clusters.of(c)) holders[at(i)].push_back(c);
  }
  for (std::size_t v = 0; v < state.skin.owner.size(); ++v) {
    const int32_t owner = state.skin.owner[v];
    const Sum rest = real(body.rest_position(owner)), place = real(state.x[at(owner)]);
    Sum beside = {}, sum = {};
    const auto own = static_cast<Real>(setup.step.volume_share);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      beside[axis] = static_cast<Real>(state.skin.reach[v]) * static_cast<Real>(body.grid.spacing) *
                     static_cast<Real>(kDirections[state.skin.direction[v]][axis]);
    }
    for (const int32_t c : holders[at(owner)]) {
      const Sum at_rest = real(clusters.rest_center[at(c)]);
      for (std::size_t row = 0; row < 3; ++row) {
        Real there = own * place[row] + (1 - own) * center[at(c)][row];
        for (std::size_t k = 0; k < 3; ++k) {
          there += static_cast<Real>(maps[at(c)].goal.m[3 * row + k]) * (rest[k] - at_rest[k]) +
                   static_cast<Real>(maps[at(c)].carry.m[3 * row + k]) * beside[k];
        }
        sum[row] += there;
      }
    }
    for (Real& entry : sum) entry /= static_cast<Real>(holders[at(owner)].size());
    state.skin.position[v] = wide(sum);
  }
}

void sum_anew(const Setup& setup, const std::string& how, int last, State& state) {
  if (how != "plain" && how != "from the first" && how != "whole masses") return;
  if (last == CUTPROOF_SKIN) sum_skin(setup, how, state);
  if (last == CUTPROOF_SPLIT || last == CUTPROOF_MERGE || last == CUTPROOF_EXPAND) {
    sum_rest_frames(setup.body, how, state.clusters);
  }
}

// --- Faults ----------------------------------------------------------------------------------------------------------

void forget_cluster(Clusters& clusters, int32_t c) {
  const auto first = clusters.members.begin() + clusters.offsets[at(c)];
  const int64_t size = clusters.size(c);
  clusters.members.erase(first, first + size);
  clusters.offsets.erase(clusters.offsets.begin() + c);
  for (std::size_t k = at(c); k < clusters.offsets.size(); ++k) clusters.offsets[k] -= size;
  clusters.number.erase(clusters.number.begin() + c);
  clusters.rest_center.erase(clusters.rest_center.begin() + c);
  clusters.mass.erase(clusters.mass.begin() + c);
  clusters.rotation.erase(clusters.rotation.begin() + c);
  clusters.degenerate.erase(clusters.degenerate.begin() + c);
}

// The least that is wrong with each stage.
void spoil(const std::string& what, int last, const State& before, State& state) {
  Clusters& clusters = state.clusters;
  if (what == "step" && last == CUTPROOF_STEP) {
    for (std::size_t i = 0; i < state.x.size(); ++i) {
      if (state.alive[i] != 0 && !(state.x[i] == before.x[i])) {
        state.x[i].y += 1e-3 * norm(state.x[i] - before.x[i]);
        return;
      }
    }
  }
  // The first particle that the blade takes stays.
  if (what == "detect" && last == CUTPROOF_DETECT && !state.removed.empty()) {
    state.alive[at(state.removed.front())] = 1;
    state.removed.erase(state.removed.begin());
  }
  // The first cluster takes the last living particle, wherever that is.
  if (what == "expand" && last == CUTPROOF_EXPAND && clusters.count() > 0) {
    int32_t i = static_cast<int32_t>(state.x.size()) - 1;
    while (i >= 0 && state.alive[at(i)] == 0) --i;
    const int64_t end = clusters.offsets[1];
    if (i >= 0 && clusters.members[at(end - 1)] < i) {
      clusters.members.insert(clusters.members.begin() + end, i);
      for (std::size_t c = 1; c < clusters.offsets.size(); ++c) ++clusters.offsets[c];
    }
  }
  // The last cluster that a split made is lost.
  if (what == "split" && last == CUTPROOF_SPLIT && clusters.count() > before.clusters.count()) {
    forget_cluster(clusters, clusters.count() - 1);
  }
  // Pieces of fewer than four particles are lost.
  if (what == "small pieces" && last == CUTPROOF_SPLIT && before.clusters.count() > 0) {
    for (int32_t c = clusters.count() - 1; c >= 0 && clusters.number[at(c)] > before.clusters.number.back(); --c) {
      if (clusters.size(c) < 4) forget_cluster(clusters, c);
    }
  }
  // What was merged keeps the rotation of the wrong one.
  if (what == "merge" && last == CUTPROOF_MERGE && clusters.count() < before.clusters.count() && clusters.count() > 0) {
    clusters.rotation.front() = {{0, -1, 0, 1, 0, 0, 0, 0, 1}};
  }
  if (what == "skin" && last == CUTPROOF_SKIN && !state.skin.triangles.empty()) {
    std::swap(state.skin.triangles.back()[0], state.skin.triangles.back()[1]);
  }
  if (what == "one reach" && last == CUTPROOF_SKIN && !state.skin.reach.empty()) state.skin.reach.pop_back();
}

// The skin of a dual method: where marching cubes has its vertices their means, and no owner's edge.
void make_dual(const Setup& setup, const std::string& fault, State& state) {
  state.skin = {};
  reference::skin(setup, state);
  const Body& body = setup.body;
  std::vector<uint8_t> living(at(body.grid.node_count()), 0);
  for (std::size_t i = 0; i < state.alive.size(); ++i) living[at(body.node[i])] = state.alive[i];
  std::map<int64_t, std::size_t> vertex_on;
  for (std::size_t v = 0; v < state.skin.owner.size(); ++v) {
    const int direction = state.skin.direction[v];
    auto low = body.grid.coordinates(body.node[at(state.skin.owner[v])]);
    if (direction % 2 == 1) --low[at(direction / 2)];
    vertex_on[3 * body.grid.index(low[0], low[1], low[2]) + direction / 2] = v;
  }
  const surface_nets::Net net = surface_nets::make(
      body.grid.nodes, living,
      [&](int64_t edge) {
        const Vec3 p = state.skin.position[vertex_on.at(edge)];
        return surface_nets::Place{p.x, p.y, p.z};
      },
      fault);
  Skin dual;
  dual.triangles = net.triangles;
  for (std::size_t v = 0; v < net.vertices.size(); ++v) {
    const std::size_t from = vertex_on.at(net.edge[v]);
    dual.owner.push_back(state.skin.owner[from]);
    dual.direction.push_back(state.skin.direction[from]);
    dual.reach.push_back(0.5);
    dual.position.push_back({net.vertices[v][0], net.vertices[v][1], net.vertices[v][2]});
  }
  state.skin = std::move(dual);
}

int run(const cutproof_host* host, void* self, int first, int last, cutproof_state* given) {
  auto* const instance = static_cast<Instance*>(self);
  const State before = state_of(given);
  instance->reference->load({instance->setup}, {before});
  instance->reference->run({static_cast<Stage>(first), static_cast<Stage>(last)});
  State state = instance->reference->snapshot().front();
  sum_anew(instance->setup, instance->spoiled, last, state);
  spoil(instance->spoiled, last, before, state);
  if (instance->spoiled.starts_with("dual") && last == CUTPROOF_SKIN && instance->setup.skin.wanted) {
    make_dual(instance->setup, instance->spoiled.substr(4), state);
  }
  return give(host, state, given, instance->spoiled == "all reaches" ? "reach" : "") ? 0 : 1;
}

int rotations(const cutproof_host*, void* self, const cutproof_array* a, const cutproof_array* previous,
              cutproof_array* r) {
  for (int64_t i = 0; i < a->rows; ++i) {
    Mat3 from, before;
    get_row(a, i, from);
    get_row(previous, i, before);
    reference::Rotation best = reference::closest_rotation(from, before);
    const std::string& spoiled = static_cast<Instance*>(self)->spoiled;
    if (spoiled == "rotations" && !std::isfinite(from.m[0])) best.r = Mat3{};
    if (spoiled == "transpose") best.r = transposed(best.r);
    if (spoiled == "itself") best.r = from;
    if (spoiled == "previous") best.r = before;
    for (std::size_t k = 0; k < 3 && spoiled == "mirrored"; ++k) std::swap(best.r.m[k], best.r.m[3 + k]);
    if (spoiled == "first_16384" && i >= 16384) return 0;
    if (spoiled == "index16" && i >= 65535) return 0;
    set_row(r, i, best.r);
  }
  return 0;
}

int surface(const cutproof_host* host, void* self, const cutproof_tissue* tissue, const cutproof_array* alive,
            cutproof_array* vertices, cutproof_array* triangles) {
  Setup setup;
  setup.body = body_of(tissue);
  State state;
  for (int64_t i = 0; i < alive->rows; ++i) {
    state.x.push_back(setup.body.rest_position(static_cast<int32_t>(i)));
    state.alive.push_back(static_cast<uint8_t>(number(alive, i)));
  }
  // A cluster for each living particle, which does not turn.
  for (int64_t i = 0; i < alive->rows; ++i) {
    if (state.alive[at(i)] == 0) continue;
    state.clusters.members.push_back(static_cast<int32_t>(i));
    state.clusters.offsets.push_back(static_cast<int64_t>(state.clusters.members.size()));
    state.clusters.number.push_back(state.clusters.count() - 1);
    state.clusters.rotation.emplace_back();
    state.clusters.degenerate.push_back(0);
  }
  state.v.resize(state.x.size());
  reference::update_rest_frames(setup.body, state.clusters);
  reference::skin(setup, state);
  spoil(static_cast<Instance*>(self)->spoiled == "surface" ? "skin" : "", CUTPROOF_SKIN, state, state);
  if (host->grow(host, vertices, static_cast<int64_t>(state.skin.position.size())) != 0) return 1;
  if (host->grow(host, triangles, static_cast<int64_t>(state.skin.triangles.size())) != 0) return 1;
  for (int64_t v = 0; v < vertices->rows; ++v) set_row(vertices, v, state.skin.position[at(v)]);
  if (static_cast<Instance*>(self)->spoiled == "index16") {
    for (auto& triangle : state.skin.triangles) {
      for (int32_t& v : triangle) v &= 0xffff;
    }
  }
  for (int64_t t = 0; t < triangles->rows; ++t) set_row(triangles, t, state.skin.triangles[at(t)]);
  return 0;
}

}  // namespace reference_plugin
