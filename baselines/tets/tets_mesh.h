// A mesh of tetrahedra and how a blade splits it. Both programs use it: which edges are crossed they find themselves.
//
// An edge that a blade has crossed is *marked*. Marks stay, so those of a stroke add up over its frames. A tetrahedron
// falls apart once marked edges part its vertices: three marked edges leave 1 + 3 tetrahedra, four leave 3 + 3, five
// and six leave three and four parts. Until then it stays whole: the end of a cut lies on faces of whole cells, and the
// vertices that are new there hang on their edges.
//
// A part gets vertices of its own on the edges that are cut: one for each edge and side, shared by all tetrahedra
// there. So parts of two sides have no vertex in common, whatever the order of cuts.
#pragma once
#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <span>
#include <stdexcept>
#include <utility>
#include <vector>

#include "baselines/dissection.h"

namespace cutproof::baselines::tets {

using Edge = std::array<int32_t, 2>;         // the smaller end first
using Tetrahedron = std::array<int32_t, 4>;  // (x₁ - x₀) × (x₂ - x₀) · (x₃ - x₀) is positive at rest

// The six edges of a tetrahedron, by its corners.
inline constexpr int kCornersOfEdges[6][2] = {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}};
// A cut passes an edge no nearer to an end than this share of its length: thinner slices have no useful mass.
inline constexpr double kLeastShare = 0.1;
// How near to a blade a new vertex counts as on its surface [spacings]: more than the tenth of a cube's diagonal by
// which it may have been moved.
inline constexpr double kThickness = 0.2;

inline Edge edge_of(int32_t a, int32_t b) { return {std::min(a, b), std::max(a, b)}; }
// Signed volume [m³].
inline double volume_of(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  return (b - a).cross(c - a).dot(d - a) / 6;
}

// An edge that a blade crosses.
struct Crossing {
  Edge edge;
  double share = 0.5;  // of the way from its first end to its second
};

class Mesh {
 public:
  explicit Mesh(const Scene& scene);

  int32_t size() const { return static_cast<int32_t>(rest_.size()); }
  int32_t particles() const { return particles_; }  // of the scene: the first vertices
  const std::vector<Vec3>& rest() const { return rest_; }
  const std::vector<int32_t>& parent() const { return parent_; }  // [size] the vertex on the same side; -1: a particle
  const std::vector<Edge>& ends() const { return ends_; }  // [size] of the edge that it lies on; of a particle itself
  const std::vector<Tetrahedron>& tetrahedra() const { return tetrahedra_; }
  const std::vector<double>& volume() const { return volume_; }  // [tetrahedra] m³ at rest
  // Edges of the scene that lie in no cube of it: links without volume.
  const std::vector<Edge>& links() const { return links_; }
  const std::vector<Edge>& edges() const { return edges_; }  // of tetrahedra and links, each once, ascending
  std::size_t edge_number(int32_t a, int32_t b) const;       // of one that there is, in edges()
  // [size] The particle that is fewest edges away, of the same piece; -1: the piece has none.
  std::vector<int32_t> nearest_particles() const;

  // A share of a vertex's mass that comes from the middle of an edge.
  struct Part {
    int32_t vertex;
    Edge edge;
    double share;   // of the way along the edge
    double volume;  // a quarter of the tetrahedron's [m³]
  };
  // Marks edges and splits what they part. Returns what new tetrahedra give to vertices on edges: of vertices that are
  // new all of their mass, of others some. What is new may be cut as well, so call it again until it returns nothing.
  std::vector<Part> cut(const std::vector<Crossing>& crossings);

 private:
  struct Mark {
    double share = 0.5;
    std::array<int32_t, 2> vertex = {-1, -1};  // on the side of each end
  };
  bool is_marked(int32_t a, int32_t b) const { return marks_.find(edge_of(a, b)) != marks_.end(); }
  bool is_cut(int32_t a, int32_t b) const;
  std::array<int, 4> parts_of(const Tetrahedron& tetrahedron) const;
  void split(const Tetrahedron& whole, const std::array<int, 4>& part, std::vector<Tetrahedron>& pieces,
             std::vector<Part>& given);
  int32_t new_vertex(const Edge& edge, double share, int32_t parent);
  void list_edges();

  int32_t particles_ = 0;
  std::vector<Vec3> rest_;
  std::vector<int32_t> parent_;
  std::vector<Edge> ends_;
  std::vector<int32_t> particle_;  // [size] at the end of the chain of parents
  std::vector<Tetrahedron> tetrahedra_;
  std::vector<double> volume_;
  std::vector<Edge> links_, edges_;
  std::vector<std::size_t> edge_starts_;  // [size + 1] of edges_, by their first ends
  std::map<Edge, Mark> marks_;
  std::vector<uint8_t> is_new_;  // [tetrahedra] split off and not looked at yet
};

// After a cut: places of vertices, or their velocities, for `old` ones. A new vertex lies where the tetrahedron has
// that point. One that was there before, and gains mass, takes the mean by mass. So a cut moves neither the total
// momentum nor the centre of mass.
std::vector<Vec3> after_cut(const Mesh& mesh, const std::vector<Mesh::Part>& parts, const std::vector<Vec3>& old);

// --- Implementation --------------------------------------------------------------------------------------------------

inline Mesh::Mesh(const Scene& scene)
    : particles_(static_cast<int32_t>(scene.rest.size())), rest_(scene.rest), parent_(scene.rest.size(), -1) {
  for (int32_t i = 0; i < particles_; ++i) ends_.push_back({i, i}), particle_.push_back(i);
  for (Tetrahedron t : scene.tetrahedra) {
    for (const int32_t i : t) {
      if (i < 0 || i >= particles_) throw std::invalid_argument("a tetrahedron has a corner that is no particle");
    }
    const auto at = [&](std::size_t k) { return rest_[static_cast<std::size_t>(t[k])]; };
    const double volume = volume_of(at(0), at(1), at(2), at(3));
    if (volume < 0) std::swap(t[0], t[1]);
    tetrahedra_.push_back(t);
    volume_.push_back(std::abs(volume));
    is_new_.push_back(0);
  }
  // What lies in a cube, its tetrahedra hold.
  std::vector<Edge> held;
  const auto hold = [&](const auto& corners) {
    for (std::size_t k = 0; k < corners.size(); ++k) {
      for (std::size_t l = 0; l < k; ++l) held.push_back(edge_of(corners[k], corners[l]));
    }
  };
  for (const auto& cell : scene.tetrahedra) hold(cell);
  if (!scene.tetrahedra.empty()) {
    for (const auto& cube : scene.hexahedra) hold(cube);
  }
  std::sort(held.begin(), held.end());
  for (const auto& [a, b] : scene.edges) {
    if (!std::binary_search(held.begin(), held.end(), edge_of(a, b))) links_.push_back(edge_of(a, b));
  }
  std::sort(links_.begin(), links_.end());
  list_edges();
}

// Sorted by first ends, then each vertex's few: much faster than a sort of all.
inline void Mesh::list_edges() {
  const auto each = [&](const auto& visit) {
    for (const Edge& link : links_) visit(link);
    for (const Tetrahedron& t : tetrahedra_) {
      for (const auto& [k, l] : kCornersOfEdges)
        visit(edge_of(t[static_cast<std::size_t>(k)], t[static_cast<std::size_t>(l)]));
    }
  };
  std::vector<std::size_t> next(rest_.size() + 1);
  each([&](const Edge& edge) { ++next[static_cast<std::size_t>(edge[0]) + 1]; });
  for (std::size_t i = 1; i < next.size(); ++i) next[i] += next[i - 1];
  std::vector<int32_t> others(next.back());
  const std::vector<std::size_t> starts = next;
  each([&](const Edge& edge) { others[next[static_cast<std::size_t>(edge[0])]++] = edge[1]; });
  edges_.clear();
  edge_starts_ = {0};
  for (std::size_t i = 0; i < rest_.size(); ++i) {
    const auto begin = others.begin() + static_cast<std::ptrdiff_t>(starts[i]),
               end = others.begin() + static_cast<std::ptrdiff_t>(starts[i + 1]);
    std::sort(begin, end);
    const auto last = std::unique(begin, end);
    for (auto other = begin; other != last; ++other) edges_.push_back({static_cast<int32_t>(i), *other});
    edge_starts_.push_back(edges_.size());
  }
}

inline std::size_t Mesh::edge_number(int32_t a, int32_t b) const {
  const Edge edge = edge_of(a, b);
  const auto first = edges_.begin();
  const auto i = edge_starts_.begin() + edge[0];
  return static_cast<std::size_t>(
      std::lower_bound(first + static_cast<std::ptrdiff_t>(*i), first + static_cast<std::ptrdiff_t>(*(i + 1)), edge) -
      first);
}

inline std::vector<int32_t> Mesh::nearest_particles() const {
  std::vector<int32_t> nearest(rest_.size(), -1);
  for (int32_t i = 0; i < particles_; ++i) nearest[static_cast<std::size_t>(i)] = i;
  for (bool is_changed = true; is_changed;) {
    std::vector<std::pair<int32_t, int32_t>> reached;  // vertices of the next layer
    for (const auto& [a, b] : edges_) {
      const int32_t of_a = nearest[static_cast<std::size_t>(a)], of_b = nearest[static_cast<std::size_t>(b)];
      if ((of_a < 0) != (of_b < 0)) reached.emplace_back(of_a < 0 ? a : b, std::max(of_a, of_b));
    }
    std::sort(reached.begin(), reached.end(), std::greater<>());
    for (const auto& [vertex, particle] : reached) nearest[static_cast<std::size_t>(vertex)] = particle;
    is_changed = !reached.empty();
  }
  return nearest;
}

// A blade that passes between two particles passes between what is new on their sides, whenever that was split off.
// Else a blade would forget what it has swept of a cell that another one splits before it comes to the cell's end.
inline bool Mesh::is_cut(int32_t a, int32_t b) const {
  const int32_t of_a = particle_[static_cast<std::size_t>(a)], of_b = particle_[static_cast<std::size_t>(b)];
  return is_marked(a, b) || (of_a != of_b && is_marked(of_a, of_b));
}

// A number for each corner: equal where edges join them that are not cut.
inline std::array<int, 4> Mesh::parts_of(const Tetrahedron& t) const {
  std::array<int, 4> part = {0, 1, 2, 3};
  const auto join = [&](int one, int other) {
    for (int& p : part) p = p == std::max(one, other) ? std::min(one, other) : p;
  };
  for (const auto& [k, l] : kCornersOfEdges) {
    const auto i = static_cast<std::size_t>(k), j = static_cast<std::size_t>(l);
    if (!is_cut(t[i], t[j])) join(part[i], part[j]);
  }
  return part;
}

inline int32_t Mesh::new_vertex(const Edge& edge, double share, int32_t parent) {
  const Vec3 a = rest_[static_cast<std::size_t>(edge[0])], b = rest_[static_cast<std::size_t>(edge[1])];
  rest_.push_back((1 - share) * a + share * b);
  parent_.push_back(parent);
  ends_.push_back(edge);
  particle_.push_back(particle_[static_cast<std::size_t>(parent)]);
  return size() - 1;
}

// Bisects the edges that are cut, in ascending order, so that cells split alike the faces that they share. No edge is
// left that is cut, so each tetrahedron lies in one part, and has a corner of the whole one.
inline void Mesh::split(const Tetrahedron& whole, const std::array<int, 4>& part, std::vector<Tetrahedron>& pieces,
                        std::vector<Part>& given) {
  struct Point {
    Edge edge;
    double share;
    std::array<int, 2> part;  // of the edge's ends
  };
  std::vector<Point> points;
  for (const auto& [k, l] : kCornersOfEdges) {
    const auto i = static_cast<std::size_t>(k), j = static_cast<std::size_t>(l);
    if (part[i] == part[j]) continue;
    const Edge edge = edge_of(whole[i], whole[j]);
    const bool is_ordered = edge[0] == whole[i];
    points.push_back({edge, marks_[edge].share, {part[is_ordered ? i : j], part[is_ordered ? j : i]}});
  }
  std::sort(points.begin(), points.end(), [](const Point& a, const Point& b) { return a.edge < b.edge; });
  // A point on an edge is -1 - its number until it is known on which side it is wanted.
  std::vector<Tetrahedron> cells = {whole};
  for (std::size_t p = 0; p < points.size(); ++p) {
    std::vector<Tetrahedron> next;
    for (const Tetrahedron& cell : cells) {
      const auto a = std::find(cell.begin(), cell.end(), points[p].edge[0]),
                 b = std::find(cell.begin(), cell.end(), points[p].edge[1]);
      if (a == cell.end() || b == cell.end()) {
        next.push_back(cell);
        continue;
      }
      Tetrahedron one = cell, other = cell;
      one[static_cast<std::size_t>(b - cell.begin())] = other[static_cast<std::size_t>(a - cell.begin())] =
          -1 - static_cast<int32_t>(p);
      next.push_back(one);
      next.push_back(other);
    }
    cells = std::move(next);
  }
  std::map<std::pair<int32_t, int>, int32_t> here;  // points on edges of which this part has neither end
  for (const Tetrahedron& cell : cells) {
    int of = -1;
    for (const int32_t corner : cell) {
      const auto found = std::find(whole.begin(), whole.end(), corner);
      if (found != whole.end()) of = part[static_cast<std::size_t>(found - whole.begin())];
    }
    Tetrahedron piece = cell;
    // By edges, not by corners: numbers of new vertices do not depend on how corners are listed.
    std::array<std::size_t, 4> order = {0, 1, 2, 3};
    std::sort(order.begin(), order.end(), [&](std::size_t k, std::size_t l) { return cell[k] > cell[l]; });
    for (const std::size_t k : order) {
      int32_t& corner = piece[k];
      if (corner >= 0) continue;
      const Point& point = points[static_cast<std::size_t>(-1 - corner)];
      if (of != point.part[0] && of != point.part[1]) {
        const auto [known, is_new] = here.emplace(std::pair(corner, of), -1);
        int32_t parent = std::numeric_limits<int32_t>::max();
        for (std::size_t l = 0; l < 4; ++l) parent = part[l] == of ? std::min(parent, whole[l]) : parent;
        if (is_new) known->second = new_vertex(point.edge, point.share, parent);
        corner = known->second;
        continue;
      }
      const std::size_t side = of == point.part[0] ? 0 : 1;
      int32_t& vertex = marks_.at(point.edge).vertex[side];
      // One that was cut off from its end since lies in another piece.
      if (vertex < 0 || is_marked(vertex, point.edge[side]))
        vertex = new_vertex(point.edge, point.share, point.edge[side]);
      corner = vertex;
    }
    const auto at = [&](std::size_t k) { return rest_[static_cast<std::size_t>(piece[k])]; };
    const double volume = volume_of(at(0), at(1), at(2), at(3));
    for (std::size_t k = 0; k < 4; ++k) {
      if (cell[k] >= 0) continue;
      const Point& point = points[static_cast<std::size_t>(-1 - cell[k])];
      given.push_back({piece[k], point.edge, point.share, volume / 4});
    }
    pieces.push_back(piece);
    volume_.push_back(volume);
    is_new_.push_back(1);
  }
}

inline std::vector<Mesh::Part> Mesh::cut(const std::vector<Crossing>& crossings) {
  if (crossings.empty() && std::find(is_new_.begin(), is_new_.end(), 1) == is_new_.end()) return {};
  for (const Crossing& crossing : crossings) {
    Mark& mark = marks_[crossing.edge];
    // Where there are vertices its place is fixed.
    if (mark.vertex[0] < 0 && mark.vertex[1] < 0) mark.share = std::clamp(crossing.share, kLeastShare, 1 - kLeastShare);
  }
  const auto fewer = std::erase_if(links_, [&](const Edge& link) { return is_marked(link[0], link[1]); });
  std::vector<uint8_t> is_met(rest_.size());
  for (const Crossing& crossing : crossings) {
    for (const int32_t end : crossing.edge) is_met[static_cast<std::size_t>(end)] = 1;
  }
  std::vector<Part> given;
  std::vector<Tetrahedron> pieces;
  const std::vector<double> old_volume = std::exchange(volume_, {});
  const std::vector<uint8_t> was_new = std::exchange(is_new_, {});
  for (std::size_t c = 0; c < tetrahedra_.size(); ++c) {
    int met = 0;
    for (const int32_t i : tetrahedra_[c])
      met += is_met[static_cast<std::size_t>(i)] |
             is_met[static_cast<std::size_t>(particle_[static_cast<std::size_t>(i)])];
    const std::array<int, 4> part = met < 2 && was_new[c] == 0 ? std::array<int, 4>{} : parts_of(tetrahedra_[c]);
    if (part == std::array<int, 4>{}) {
      pieces.push_back(tetrahedra_[c]);
      volume_.push_back(old_volume[c]);
      is_new_.push_back(0);
    } else {
      split(tetrahedra_[c], part, pieces, given);
    }
  }
  tetrahedra_ = std::move(pieces);
  if (!given.empty() || fewer > 0) list_edges();
  return given;
}

inline std::vector<Vec3> after_cut(const Mesh& mesh, const std::vector<Mesh::Part>& parts,
                                   const std::vector<Vec3>& old) {
  const auto count = static_cast<std::size_t>(mesh.size());
  std::vector<double> own(count), gained(count);
  std::vector<Vec3> sum(count, Vec3::Zero()), now = old;
  for (std::size_t c = 0; c < mesh.tetrahedra().size(); ++c) {
    for (const int32_t i : mesh.tetrahedra()[c]) own[static_cast<std::size_t>(i)] += mesh.volume()[c] / 4;
  }
  now.resize(count, Vec3::Zero());
  for (const Mesh::Part& part : parts) {
    const auto i = static_cast<std::size_t>(part.vertex);
    const Vec3 a = old[static_cast<std::size_t>(part.edge[0])], b = old[static_cast<std::size_t>(part.edge[1])];
    const Vec3 there = (1 - part.share) * a + part.share * b;
    // Of a new vertex all parts lie at one place. No sum, so that it is there to the bit.
    now[i] = i >= old.size() ? there : now[i];
    gained[i] += part.volume;
    sum[i] += part.volume * there;
  }
  for (std::size_t i = 0; i < old.size(); ++i) {
    if (gained[i] > 0) now[i] = (std::max(own[i] - gained[i], 0.0) * old[i] + sum[i]) / std::max(own[i], gained[i]);
  }
  return now;
}

}  // namespace cutproof::baselines::tets
