// The split stage of a simulator: each connected piece of a cut cluster becomes a cluster. It has a fault.
// docs/tutorial.md finds it.
#include <cutproof/plugin.h>

#include <algorithm>
#include <vector>

struct Simulator {
  std::vector<double> rest, mass;  // [n x 3] m, [n] kg
  double h;                        // spacing of particles [m]
  int32_t fewest;                  // pieces of tissue with fewer particles are removed as debris
};

// --- The simulator's own part

static bool neighbours(const Simulator& s, int32_t i, int32_t j) {
  double d2 = 0;
  for (int k = 0; k < 3; ++k) d2 += (s.rest[3 * i + k] - s.rest[3 * j + k]) * (s.rest[3 * i + k] - s.rest[3 * j + k]);
  return d2 < 1.5 * 1.5 * s.h * s.h;
}

// The connected pieces of some particles, each ascending, in the order of their smallest particles.
static std::vector<std::vector<int32_t>> pieces_of(const Simulator& s, std::vector<int32_t> left) {
  std::vector<std::vector<int32_t>> pieces;
  while (!left.empty()) {
    std::vector<int32_t> piece = {left.front()};
    left.erase(left.begin());
    for (size_t next = 0; next < piece.size(); ++next) {
      const auto apart = [&, from = piece[next]](int32_t p) { return !neighbours(s, from, p); };
      const auto reached = std::stable_partition(left.begin(), left.end(), apart);
      piece.insert(piece.end(), reached, left.end());
      left.erase(reached, left.end());
    }
    std::sort(piece.begin(), piece.end());
    pieces.push_back(piece);
  }
  return pieces;
}

static std::vector<int32_t> remove_debris(const Simulator& s, std::vector<uint8_t>& alive) {
  std::vector<int32_t> tissue, debris;
  for (int32_t p = 0; p < (int32_t)alive.size(); ++p) {
    if (alive[p] && s.fewest > 0) tissue.push_back(p);
  }
  for (const auto& piece : pieces_of(s, tissue)) {
    if ((int32_t)piece.size() < s.fewest) debris.insert(debris.end(), piece.begin(), piece.end());
  }
  std::sort(debris.begin(), debris.end());
  for (const int32_t p : debris) alive[p] = 0;
  return debris;
}

struct Cluster {
  std::vector<int32_t> members;
  int32_t number, parent;  // parent: the cluster that it was, or was a piece of
  bool is_whole;           // it has lost nothing
};

// In order: clusters that are whole and the first pieces of the others, under their numbers; then all other pieces,
// under new numbers.
static std::vector<Cluster> split(const Simulator& s, const std::vector<uint8_t>& alive,
                                  const std::vector<int64_t>& offsets, const std::vector<int32_t>& members,
                                  const std::vector<int32_t>& number) {
  std::vector<Cluster> clusters, others;
  for (int32_t c = 0; c < (int32_t)number.size(); ++c) {
    std::vector<int32_t> left;
    for (int64_t k = offsets[c]; k < offsets[c + 1]; ++k) {
      if (alive[members[k]]) left.push_back(members[k]);
    }
    if ((int64_t)left.size() == offsets[c + 1] - offsets[c]) {
      clusters.push_back({left, number[c], c, true});
      continue;
    }
    const auto pieces = pieces_of(s, left);
    for (size_t k = 0; k < pieces.size(); ++k) (k == 0 ? clusters : others).push_back({pieces[k], number[c], c, false});
  }
  for (size_t k = 0; k < others.size(); ++k) {
    others[k].number = number.back() + 1 + (int32_t)k;
    clusters.push_back(others[k]);
  }
  return clusters;
}

// --- What makes it a plugin: arrays in, arrays out

template <class T>
static std::vector<T> get(const cutproof_array* a) {
  return {(const T*)a->data, (const T*)a->data + a->rows * a->columns};
}
template <class T>
static int put(const cutproof_host* host, cutproof_array* a, const std::vector<T>& values) {
  if (host->grow(host, a, (int64_t)values.size() / a->columns) != 0) return 1;
  std::copy(values.begin(), values.end(), (T*)a->data);
  return 0;
}

static int run(const cutproof_host* host, void* self, int, int, cutproof_state* state) {
  const Simulator& s = *(const Simulator*)self;
  auto alive = get<uint8_t>(state->alive);
  const auto debris = remove_debris(s, alive);
  const auto old_members = get<int32_t>(state->members);
  const auto old_center = get<double>(state->rest_center), old_mass = get<double>(state->mass);
  const auto old_rotation = get<double>(state->rotation);
  const auto old_degenerate = get<uint8_t>(state->degenerate);
  std::vector<int> holders(s.mass.size());  // clusters that hold a particle: a split changes none of these numbers
  for (const int32_t p : old_members) ++holders[p];

  std::vector<int64_t> offsets = {0};
  std::vector<int32_t> members, number;
  std::vector<double> center, mass, rotation;
  std::vector<uint8_t> degenerate;
  for (const Cluster& cluster :
       split(s, alive, get<int64_t>(state->offsets), old_members, get<int32_t>(state->number))) {
    double t[3] = {0, 0, 0}, m = 0;  // each containing cluster has an equal share of a particle's mass
    for (const int32_t p : cluster.members) {
      for (int k = 0; k < 3; ++k) t[k] += s.mass[p] / holders[p] * s.rest[3 * p + k];
      m += s.mass[p] / holders[p];
    }
    const int32_t from = cluster.parent;
    for (int k = 0; k < 3; ++k) center.push_back(cluster.is_whole ? old_center[3 * from + k] : t[k] / m);
    mass.push_back(cluster.is_whole ? old_mass[from] : m);
    rotation.insert(rotation.end(), &old_rotation[9 * from], &old_rotation[9 * from] + 9);
    degenerate.push_back(old_degenerate[from]);
    members.insert(members.end(), cluster.members.begin(), cluster.members.end());
    offsets.push_back((int64_t)members.size());
    number.push_back(cluster.number);
  }
  return put(host, state->alive, alive) | put(host, state->debris, debris) | put(host, state->offsets, offsets) |
         put(host, state->members, members) | put(host, state->number, number) | put(host, state->rest_center, center) |
         put(host, state->mass, mass) | put(host, state->rotation, rotation) | put(host, state->degenerate, degenerate);
}

static int can_run(int first, int last) { return first == CUTPROOF_SPLIT && last == CUTPROOF_SPLIT; }
static int load(const cutproof_host* host, void* self, const cutproof_tissue* tissue, const cutproof_state*) {
  *(Simulator*)self = {get<double>(tissue->rest), get<double>(tissue->mass), tissue->spacing,
                       get<int32_t>(host->setup(host, "split/debris"))[0]};
  return 0;
}
static void* create(const cutproof_host*, const char*) { return new Simulator; }
static void destroy(void* self) { delete (Simulator*)self; }

static const cutproof_plugin plugin = {.size = sizeof(cutproof_plugin),
                                       .abi = CUTPROOF_ABI,
                                       .name = "splitter",
                                       .version = "1",
                                       .device = CUTPROOF_HOST,
                                       .real = CUTPROOF_F64,
                                       .create = create,
                                       .destroy = destroy,
                                       .can_run = can_run,
                                       .load = load,
                                       .run = run};
CUTPROOF_PLUGIN(plugin)
