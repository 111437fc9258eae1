#include "guests/questions/kinds.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <functional>
#include <map>
#include <numeric>
#include <set>
#include <utility>

#include "guests/tissue_arrays.h"
#include "model/at.h"
#include "model/bare_graph.h"

namespace cutproof::guests {

std::span<const OperationDescription> operations() {
  static const std::array all = {kRotations, kComponents, kSurface, kClusters, kDissect};
  return all;
}

const OperationDescription* find_operation(std::string_view name) {
  for (const OperationDescription& each : operations()) {
    if (each.name == name) return &each;
  }
  return nullptr;
}

Verdict unreadable(std::string_view property, const std::string& why) {
  Verdict verdict;
  verdict.property = property;
  verdict.holds = false;
  verdict.measured = 1;
  verdict.unit = "1";
  verdict.checked = 1;
  verdict.bound_source = "cutproof/plugin.h";
  verdict.witness.text = why;
  return verdict;
}

uint64_t mixed(uint64_t seed, int64_t index) {
  uint64_t x = seed;
  for (const uint64_t add : {uint64_t{0}, static_cast<uint64_t>(index)}) {
    x += add + 0x9e3779b97f4a7c15ULL;
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
    x ^= x >> 31;
  }
  return x;
}

int64_t one_body(const Question&) { return 1; }
std::string size_of_body(const Question& question) {
  const int64_t n = find_array(question.given, "alive")->rows();
  return std::to_string(n) + (n == 1 ? " particle" : " particles");
}

Array rows_of(const Array& array, int64_t first, int64_t end) {
  Array part{array.name, array.type, array.shape, {}};
  part.shape[0] = end - first;
  const auto row = array.rows() == 0 ? 0 : static_cast<int64_t>(array.bytes.size()) / array.rows();
  part.bytes.assign(array.bytes.begin() + first * row, array.bytes.begin() + end * row);
  return part;
}

// --- Bodies ----------------------------------------------------------------------------------------------------------

Tissue on_grid(std::vector<std::array<int32_t, 3>> nodes, double spacing) {
  Tissue tissue;
  Body& body = tissue.body;
  body.name = "a body";
  std::array<int32_t, 3> low = {0, 0, 0}, high = {0, 0, 0};
  for (std::size_t k = 0; k < nodes.size(); ++k) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      low[axis] = k == 0 ? nodes[k][axis] : std::min(low[axis], nodes[k][axis]);
      high[axis] = k == 0 ? nodes[k][axis] : std::max(high[axis], nodes[k][axis]);
    }
  }
  for (std::size_t axis = 0; axis < 3; ++axis) body.grid.nodes[axis] = high[axis] - low[axis] + 3;
  body.grid.spacing = spacing;
  for (const auto& node : nodes) {
    body.node.push_back(body.grid.index(node[0] - low[0] + 1, node[1] - low[1] + 1, node[2] - low[2] + 1));
  }
  std::sort(body.node.begin(), body.node.end());
  body.node.erase(std::unique(body.node.begin(), body.node.end()), body.node.end());
  body.particle_at.assign(at(body.grid.node_count()), -1);
  for (std::size_t i = 0; i < body.node.size(); ++i) body.particle_at[at(body.node[i])] = static_cast<int32_t>(i);
  body.mass.assign(body.node.size(), 1000 * spacing * spacing * spacing);
  tissue.alive.assign(body.node.size(), 1);
  return tissue;
}

Tissue bare(int32_t n, const std::vector<std::array<int32_t, 2>>& edges, Random& random) {
  Tissue tissue;
  Body& body = tissue.body;
  body.name = "a graph";
  std::vector<int64_t>& offsets = body.edge_offsets;
  offsets.assign(at(n) + 1, 0);
  for (const auto& [a, b] : edges) {
    if (a == b) continue;
    ++offsets[at(a) + 1];
    ++offsets[at(b) + 1];
  }
  std::partial_sum(offsets.begin(), offsets.end(), offsets.begin());
  std::vector<int32_t> ends(at(offsets.back()));
  std::vector<int64_t> next(offsets.begin(), offsets.end() - 1);
  for (const auto& [a, b] : edges) {
    if (a == b) continue;
    ends[at(next[at(a)]++)] = b;
    ends[at(next[at(b)]++)] = a;
  }
  for (int64_t i = 0, first = 0; i < n; ++i) {
    const auto begin = ends.begin() + first, end = ends.begin() + offsets[at(i) + 1];
    std::sort(begin, end);
    body.edge_ends.insert(body.edge_ends.end(), begin, std::unique(begin, end));
    first = offsets[at(i) + 1];
    offsets[at(i) + 1] = static_cast<int64_t>(body.edge_ends.size());
  }
  for (int32_t i = 0; i < n; ++i) {
    // On the lattice of 2⁻¹⁰, so that single precision holds the places.
    const auto place = [&] { return static_cast<double>(random.below(1 << 14)) * 0x1p-10; };
    const double x = place(), y = place();
    body.rest.push_back({x, y, place()});
  }
  // Joined particles at one place would have an edge without length.
  for (int32_t i = 0; i < n; ++i) {
    for (const int32_t other : body.neighbours(i)) {
      if (other < i && norm(body.rest[at(i)] - body.rest[at(other)]) == 0) body.rest[at(i)].x += 0x1p-10 * (i + 1);
    }
  }
  body.mass.assign(at(n), 1);
  body.grid.spacing = 0;
  for (int32_t i = 0; i < n; ++i) {
    for (const int32_t other : body.neighbours(i))
      body.grid.spacing = std::max(body.grid.spacing, body.rest_length(i, other));
  }
  if (body.grid.spacing == 0) body.grid.spacing = 1;
  tissue.alive.assign(at(n), 1);
  return tissue;
}

Tissue part_of(const Tissue& tissue, const std::vector<uint8_t>& keep) {
  const Body& body = tissue.body;
  Tissue part;
  std::vector<int32_t> number(keep.size(), -1);
  int32_t count = 0;
  for (std::size_t i = 0; i < keep.size(); ++i) {
    if (keep[i] != 0) number[i] = count++;
  }
  if (body.on_grid()) {
    std::vector<std::array<int32_t, 3>> nodes;
    for (std::size_t i = 0; i < keep.size(); ++i) {
      if (keep[i] != 0) nodes.push_back(body.grid.coordinates(body.node[i]));
    }
    part = on_grid(nodes, body.grid.spacing);
  } else {
    part.body.name = body.name;
    part.body.grid = body.grid;
    part.body.edge_offsets = {0};
    for (int32_t i = 0; i < body.particle_count(); ++i) {
      if (keep[at(i)] == 0) continue;
      part.body.rest.push_back(body.rest[at(i)]);
      for (const int32_t other : body.neighbours(i)) {
        if (keep[at(other)] != 0) part.body.edge_ends.push_back(number[at(other)]);
      }
      part.body.edge_offsets.push_back(static_cast<int64_t>(part.body.edge_ends.size()));
    }
    part.body.mass.assign(at(count), 1);
  }
  part.alive.clear();
  for (std::size_t i = 0; i < keep.size(); ++i) {
    if (keep[i] != 0) part.alive.push_back(tissue.alive[i]);
  }
  return part;
}

Arrays arrays_of(const Tissue& tissue) {
  Arrays arrays = tissue_arrays(tissue.body);
  arrays.push_back(make_array("alive", {tissue.body.particle_count()}, tissue.alive));
  return arrays;
}

Tissue tissue_of(const Arrays& arrays) {
  Tissue tissue;
  Body& body = tissue.body;
  body.grid.spacing = find_array(arrays, "spacing")->number(0);
  const auto mass = find_array(arrays, "mass")->of<double>();
  body.mass.assign(mass.begin(), mass.end());
  const auto alive = find_array(arrays, "alive")->of<uint8_t>();
  tissue.alive.assign(alive.begin(), alive.end());
  if (const Array* const node = find_array(arrays, "node")) {
    for (int64_t axis = 0; axis < 3; ++axis) {
      body.grid.nodes[at(axis)] = static_cast<int32_t>(find_array(arrays, "nodes")->integer(axis));
    }
    body.particle_at.assign(at(body.grid.node_count()), -1);
    for (int64_t i = 0; i < node->rows(); ++i) {
      const auto of_axis = [&](int64_t axis) { return static_cast<int32_t>(node->integer(3 * i + axis)); };
      body.node.push_back(body.grid.index(of_axis(0), of_axis(1), of_axis(2)));
      body.particle_at[at(body.node.back())] = static_cast<int32_t>(i);
    }
    return tissue;
  }
  const auto offsets = find_array(arrays, "edge_offsets")->of<int64_t>();
  body.edge_offsets.assign(offsets.begin(), offsets.end());
  const auto ends = find_array(arrays, "edge_ends")->of<int32_t>();
  body.edge_ends.assign(ends.begin(), ends.end());
  const auto rest = find_array(arrays, "rest")->of<double>();
  for (std::size_t k = 0; k + 2 < rest.size(); k += 3) body.rest.push_back({rest[k], rest[k + 1], rest[k + 2]});
  return tissue;
}

// Of a grid that is read: each costs memory, whether or not a particle is on it.
constexpr int64_t kMostNodes = 10'000'000;

std::string problem_of_body(const Question& question) {
  const Arrays& arrays = question.given;
  const auto n = find_array(arrays, "alive")->rows();
  for (const char* const name : {"rest", "mass", "alive", "node"}) {
    const Array* const array = find_array(arrays, name);
    if (array != nullptr && array->rows() != n) return std::string("'") + name + "' is not as long as 'alive'";
  }
  if (!(find_array(arrays, "spacing")->number(0) > 0)) return "'spacing' is not positive";
  Body body;
  body.rest.resize(at(n));
  const auto offsets = find_array(arrays, "edge_offsets")->of<int64_t>();
  body.edge_offsets.assign(offsets.begin(), offsets.end());
  const auto ends = find_array(arrays, "edge_ends")->of<int32_t>();
  body.edge_ends.assign(ends.begin(), ends.end());
  if (std::string problem = problem_of_edges(body); !problem.empty()) return problem;
  const Array* const node = find_array(arrays, "node");
  if (node == nullptr) return "";
  const Array* const nodes = find_array(arrays, "nodes");
  if (nodes == nullptr || nodes->rows() != 3) return "'nodes' is missing, the extent of the grid";
  int64_t count = 1;
  for (int64_t axis = 0; axis < 3; ++axis) {
    if (nodes->integer(axis) < 1 || nodes->integer(axis) > 1000) return "'nodes' is out of range";
    count *= nodes->integer(axis);
  }
  if (count > kMostNodes) return "'nodes' is out of range";
  std::set<std::array<int64_t, 3>> taken;
  for (int64_t i = 0; i < n; ++i) {
    std::array<int64_t, 3> place = {};
    for (int64_t axis = 0; axis < 3; ++axis) {
      place[at(axis)] = node->integer(3 * i + axis);
      if (place[at(axis)] < 1 || place[at(axis)] > nodes->integer(axis) - 2) {
        return "'node' of particle " + std::to_string(i) + " is not inside the grid";
      }
    }
    if (!taken.insert(place).second) return "two particles have the node of particle " + std::to_string(i);
  }
  return "";
}

std::vector<Question> fewer_particles(const Question& question) {
  const Tissue tissue = tissue_of(question.given);
  const auto n = tissue.alive.size();
  std::vector<Question> simpler;
  const auto add = [&](const Tissue& other) {
    Question next{question.kind, arrays_of(other), question.known};
    simpler.push_back(std::move(next));
  };
  // Without a share of the particles that lie beside each other, and in the end without one.
  for (std::size_t share = n; share >= 1; share /= 2) {
    for (std::size_t first = 0; first < n && simpler.size() < 400; first += share) {
      std::vector<uint8_t> keep(n, 1);
      std::fill(keep.begin() + static_cast<std::ptrdiff_t>(first),
                keep.begin() + static_cast<std::ptrdiff_t>(std::min(first + share, n)), uint8_t{0});
      add(part_of(tissue, keep));
    }
  }
  if (std::count(tissue.alive.begin(), tissue.alive.end(), 0) > 0) {
    add(part_of(tissue, tissue.alive));
    Tissue living = tissue;
    living.alive.assign(n, 1);
    add(living);
  }
  return simpler;
}

// --- Kinds -----------------------------------------------------------------------------------------------------------

namespace {

using Nodes = std::vector<std::array<int32_t, 3>>;
using Edges = std::vector<std::array<int32_t, 2>>;

double spacing_of(Random& random) { return 0x1p-10 * random.between(1, 40); }

Nodes box(int32_t a, int32_t b, int32_t c) {
  Nodes nodes;
  for (int32_t z = 0; z < c; ++z) {
    for (int32_t y = 0; y < b; ++y) {
      for (int32_t x = 0; x < a; ++x) nodes.push_back({x, y, z});
    }
  }
  return nodes;
}
Nodes without(Nodes nodes, const std::function<bool(const std::array<int32_t, 3>&)>& gone) {
  nodes.erase(std::remove_if(nodes.begin(), nodes.end(), gone), nodes.end());
  return nodes;
}
Nodes some_box(Random& random, int32_t most) {
  const int32_t a = random.between(1, most), b = random.between(1, most);
  return box(a, b, random.between(1, most));
}

struct GridKind {
  const char* name;
  Tissue (*draw)(Random& random);
};
constexpr GridKind kGridKinds[] = {
    {"one particle",
     [](Random& r) {
       return on_grid({{0, 0, 0}}, spacing_of(r));
     }},
    {"no particle", [](Random& r) { return on_grid({}, spacing_of(r)); }},
    {"all dead",
     [](Random& r) {
       Tissue t = on_grid(some_box(r, 4), spacing_of(r));
       std::fill(t.alive.begin(), t.alive.end(), uint8_t{0});
       return t;
     }},
    {"two particles across the diagonal of a face",
     [](Random& r) {
       const Nodes pairs[] = {{{0, 0, 0}, {1, 1, 0}}, {{0, 1, 0}, {1, 0, 0}}, {{0, 0, 0}, {0, 1, 1}},
                              {{0, 1, 0}, {0, 0, 1}}, {{0, 0, 0}, {1, 0, 1}}, {{1, 0, 0}, {0, 0, 1}}};
       return on_grid(pairs[r.below(6)], spacing_of(r));
     }},
    {"two particles across the diagonal of a cell",
     [](Random& r) {
       const Nodes pairs[] = {
           {{0, 0, 0}, {1, 1, 1}}, {{1, 0, 0}, {0, 1, 1}}, {{0, 1, 0}, {1, 0, 1}}, {{0, 0, 1}, {1, 1, 0}}};
       return on_grid(pairs[r.below(4)], spacing_of(r));
     }},
    {"a cavity",
     [](Random& r) {
       const int32_t a = r.between(3, 5), b = r.between(3, 5), c = r.between(3, 5);
       const int32_t x = r.between(1, a - 2), y = r.between(1, b - 2), z = r.between(1, c - 2);
       return on_grid(without(box(a, b, c), [=](const auto& n) { return n[0] == x && n[1] == y && n[2] == z; }),
                      spacing_of(r));
     }},
    {"two cavities across a diagonal",
     [](Random& r) {
       const int32_t last = r.below(2);
       return on_grid(without(box(4, 4, 3 + last),
                              [=](const auto& n) {
                                return (n[0] == 1 && n[1] == 1 && n[2] == 1) ||
                                       (n[0] == 2 && n[1] == 2 && n[2] == 1 + last);
                              }),
                      spacing_of(r));
     }},
    {"a tunnel",
     [](Random& r) {
       const int32_t length = r.between(1, 5);
       return on_grid(without(box(3, 3, length), [](const auto& n) { return n[0] == 1 && n[1] == 1; }), spacing_of(r));
     }},
    {"a checkerboard",
     [](Random& r) {
       const int32_t odd = r.below(2);
       return on_grid(without(box(4, 3, 3), [=](const auto& n) { return (n[0] + n[1] + n[2]) % 2 == odd; }),
                      spacing_of(r));
     }},
    {"a wire",
     [](Random& r) {
       const int32_t length = r.between(2, 40);
       const Nodes wires[] = {box(length, 1, 1), box(1, length, 1), box(1, 1, length)};
       return on_grid(wires[r.below(3)], spacing_of(r));
     }},
    {"a sheet", [](Random& r) { return on_grid(box(r.between(2, 12), r.between(2, 12), 1), spacing_of(r)); }},
    {"any cell",  // each of the 256, in a while
     [](Random& r) {
       const int32_t cell = r.below(256);
       return on_grid(
           without(box(2, 2, 2), [=](const auto& n) { return (cell >> (n[0] + 2 * n[1] + 4 * n[2]) & 1) == 0; }),
           spacing_of(r));
     }},
    {"a box", [](Random& r) { return on_grid(some_box(r, 8), spacing_of(r)); }},
    {"a box that is cut by dead particles",
     [](Random& r) {
       Tissue t = on_grid(box(r.between(3, 8), r.between(2, 6), r.between(1, 5)), spacing_of(r));
       const int32_t axis = r.below(2), where = r.between(1, t.body.grid.nodes[at(axis)] - 2);
       for (std::size_t i = 0; i < t.alive.size(); ++i) {
         if (t.body.grid.coordinates(t.body.node[i])[at(axis)] == where) t.alive[i] = 0;
       }
       return t;
     }},
    {"any nodes of a box",
     [](Random& r) {
       const double p = r.unit();
       return on_grid(without(some_box(r, 7), [&](const auto&) { return r.chance(p); }), spacing_of(r));
     }},
    {"any particles of a box are dead",
     [](Random& r) {
       Tissue t = on_grid(some_box(r, 7), spacing_of(r));
       const double p = r.unit();
       for (uint8_t& alive : t.alive) alive = r.chance(p) ? 0 : 1;
       return t;
     }},
};
constexpr int64_t kGridKindCount = std::size(kGridKinds);

struct GraphKind {
  const char* name;
  Tissue (*draw)(Random& random);
};
Edges path(int32_t n) {
  Edges edges;
  for (int32_t i = 1; i < n; ++i) edges.push_back({i - 1, i});
  return edges;
}
// 0 .. n - 1 in any order.
std::vector<int32_t> shuffled(int32_t n, Random& r) {
  std::vector<int32_t> order(at(n));
  std::iota(order.begin(), order.end(), 0);
  for (int32_t k = n - 1; k > 0; --k) std::swap(order[at(k)], order[at(r.below(k + 1))]);
  return order;
}
void renumber(Edges& edges, const std::vector<int32_t>& number) {
  for (auto& [a, b] : edges) {
    a = number[at(a)];
    b = number[at(b)];
  }
}
Edges any_edges(Random& r, int32_t n, int32_t count) {
  Edges edges;
  for (int32_t k = 0; k < count && n > 1; ++k) edges.push_back({r.below(n), r.below(n)});
  return edges;
}
void kill_some(Tissue& t, Random& r, double p) {
  for (uint8_t& alive : t.alive) alive = r.chance(p) ? 0 : 1;
}
constexpr GraphKind kGraphKinds[] = {
    {"one vertex", [](Random& r) { return bare(1, {}, r); }},
    {"no vertex", [](Random& r) { return bare(0, {}, r); }},
    {"no edges", [](Random& r) { return bare(r.between(2, 80), {}, r); }},
    {"an isolated vertex",
     [](Random& r) {
       const int32_t n = r.between(3, 60), alone = r.below(n);
       Edges edges = any_edges(r, n, 3 * n);
       edges.erase(
           std::remove_if(edges.begin(), edges.end(), [&](const auto& e) { return e[0] == alone || e[1] == alone; }),
           edges.end());
       return bare(n, edges, r);
     }},
    {"the last vertex is isolated",
     [](Random& r) {
       const int32_t n = r.between(3, 60);
       return bare(n, any_edges(r, n - 1, 3 * n), r);
     }},
    {"fewer edges than vertices",
     [](Random& r) {
       const int32_t n = r.between(4, 200);
       return bare(n, any_edges(r, n, n / 3), r);
     }},
    {"n = 512 k + 1",
     [](Random& r) {
       const int32_t n = 512 * r.between(1, 4) + 1;
       return bare(n, any_edges(r, n, n), r);
     }},
    {"n beside 32, 64, 256 or 1024",
     [](Random& r) {
       constexpr int32_t kSizes[] = {32, 64, 256, 1024};
       const int32_t n = kSizes[r.below(4)] + r.between(-1, 1);
       return bare(n, any_edges(r, n, n / 2), r);
     }},
    {"a path in its order",
     [](Random& r) {
       const int32_t n = r.between(2, 2000);
       return bare(n, path(n), r);
     }},
    {"a path in any order",
     [](Random& r) {
       const int32_t n = r.between(2, 2000);
       Edges edges = path(n);
       renumber(edges, shuffled(n, r));
       return bare(n, edges, r);
     }},
    {"a star",
     [](Random& r) {
       const int32_t n = r.between(3, 600), middle = r.below(n);
       Edges edges;
       for (int32_t i = 0; i < n; ++i) edges.push_back({middle, i});
       return bare(n, edges, r);
     }},
    {"a star whose middle is dead",
     [](Random& r) {
       const int32_t n = r.between(3, 100), middle = r.below(n);
       Edges edges;
       for (int32_t i = 0; i < n; ++i) edges.push_back({middle, i});
       Tissue t = bare(n, edges, r);
       t.alive[at(middle)] = 0;
       return t;
     }},
    {"all joined to all",
     [](Random& r) {
       const int32_t n = r.between(2, 40);
       Edges edges;
       for (int32_t a = 0; a < n; ++a) {
         for (int32_t b = 0; b < a; ++b) edges.push_back({a, b});
       }
       return bare(n, edges, r);
     }},
    {"a tree",
     [](Random& r) {
       const int32_t n = r.between(2, 500);
       Edges edges;
       for (int32_t i = 1; i < n; ++i) edges.push_back({r.below(i), i});
       return bare(n, edges, r);
     }},
    {"about one edge for each vertex",  // where components grow together
     [](Random& r) {
       const int32_t n = r.between(2, 400);
       return bare(n, any_edges(r, n, n / 2 + r.below(n)), r);
     }},
    {"any vertices are dead",
     [](Random& r) {
       const int32_t n = r.between(2, 300);
       Tissue t = bare(n, any_edges(r, n, 2 * n), r);
       kill_some(t, r, r.unit());
       return t;
     }},
};
constexpr int64_t kGraphKindCount = std::size(kGraphKinds);

struct LargeKind {
  const char* name;
  Tissue (*draw)(Random& random, int32_t n);
};

// The first n nodes, of those that are `wanted`, of a box with about as many nodes along each axis.
template <class Wanted>
Tissue first_of_box(int32_t n, double nodes_for_each, Random& r, const Wanted& wanted) {
  const auto side = std::max(1, static_cast<int32_t>(std::ceil(std::cbrt(nodes_for_each * n))));
  Nodes nodes;
  for (int32_t k = 0; static_cast<int32_t>(nodes.size()) < n; ++k) {
    const std::array<int32_t, 3> node = {k % side, k / side % side, k / side / side};
    if (wanted(node)) nodes.push_back(node);
  }
  return on_grid(std::move(nodes), spacing_of(r));
}

constexpr LargeKind kLargeGridKinds[] = {
    {"a large box", [](Random& r, int32_t n) { return first_of_box(n, 1, r, [](const auto&) { return true; }); }},
    {"a large sponge",
     [](Random& r, int32_t n) { return first_of_box(n, 2, r, [&](const auto&) { return r.chance(0.5); }); }},
};

constexpr LargeKind kLargeGraphKinds[] = {
    {"many vertices without edges", [](Random& r, int32_t n) { return bare(n, {}, r); }},
    {"a long path in any order",
     [](Random& r, int32_t n) {
       Edges edges = path(n);
       renumber(edges, shuffled(n, r));
       return bare(n, edges, r);
     }},
    {"many short paths",
     [](Random& r, int32_t n) {
       Edges edges = path(n);
       std::erase_if(edges, [&](const auto&) { return r.chance(0.2); });
       renumber(edges, shuffled(n, r));
       return bare(n, edges, r);
     }},
    {"many vertices, of which some are dead",
     [](Random& r, int32_t n) {
       Tissue t = bare(n, any_edges(r, n, n), r);
       kill_some(t, r, 0.1);
       return t;
     }},
};

template <class Kinds>
std::vector<std::string> names_of(const Kinds& kinds) {
  std::vector<std::string> names;
  for (const auto& kind : kinds) names.emplace_back(kind.name);
  return names;
}

}  // namespace

std::vector<std::string> large_grid_kinds() { return names_of(kLargeGridKinds); }
Tissue draw_large_on_grid(Random& random, int64_t kind, int32_t n) { return kLargeGridKinds[kind].draw(random, n); }
std::vector<std::string> large_graph_kinds() { return names_of(kLargeGraphKinds); }
Tissue draw_large_graph(Random& random, int64_t kind, int32_t n) { return kLargeGraphKinds[kind].draw(random, n); }
uint64_t large_seed(uint64_t seed, int64_t kind) { return mixed(~seed, kind); }

std::vector<std::string> grid_kinds() { return names_of(kGridKinds); }
Tissue draw_on_grid(Random& random, int64_t kind) { return kGridKinds[kind % kGridKindCount].draw(random); }

std::vector<std::string> graph_kinds() {
  std::vector<std::string> names = names_of(kGraphKinds);
  for (const GridKind& kind : kGridKinds) names.push_back(std::string("on a grid: ") + kind.name);
  return names;
}
Tissue draw_graph(Random& random, int64_t kind) {
  kind %= kGraphKindCount + kGridKindCount;
  return kind < kGraphKindCount ? kGraphKinds[kind].draw(random) : draw_on_grid(random, kind - kGraphKindCount);
}

}  // namespace cutproof::guests
