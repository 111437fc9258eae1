#include "oracles/runs/pieces.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <utility>

#include "model/at.h"
#include "oracles/support.h"

namespace cutproof::oracles {
namespace {

// How far the segment from p to q is from the segment from a to b.
double distance_of_segments(Vec3 p, Vec3 q, Vec3 a, Vec3 b) {
  const Vec3 d = q - p, e = b - a, r = p - a;
  const double dd = dot(d, d), ee = dot(e, e), de = dot(d, e), dr = dot(d, r), er = dot(e, r);
  const double determinant = dd * ee - de * de;
  double s = determinant > 0 ? std::clamp((de * er - ee * dr) / determinant, 0.0, 1.0) : 0;
  double t = ee > 0 ? (de * s + er) / ee : 0;
  if (t < 0 || t > 1) {
    t = std::clamp(t, 0.0, 1.0);
    s = dd > 0 ? std::clamp((de * t - dr) / dd, 0.0, 1.0) : 0;
  }
  return norm((p + s * d) - (a + t * e));
}

double distance_to_triangle(Vec3 x, Vec3 a, Vec3 b, Vec3 c) {
  const Vec3 n = cross(b - a, c - a);
  const double nn = dot(n, n);
  if (nn > 0 && dot(cross(b - a, x - a), n) >= 0 && dot(cross(c - b, x - b), n) >= 0 &&
      dot(cross(a - c, x - c), n) >= 0)
    return std::abs(dot(x - a, n)) / std::sqrt(nn);
  return std::min(
      {distance_of_segments(x, x, a, b), distance_of_segments(x, x, b, c), distance_of_segments(x, x, c, a)});
}

// Where the segment from p to q goes through the triangle.
std::optional<Vec3> crossing(Vec3 p, Vec3 q, Vec3 a, Vec3 b, Vec3 c) {
  const Vec3 n = cross(b - a, c - a);
  const double from = dot(p - a, n), to = dot(q - a, n);
  if (!((from < 0) != (to < 0))) return std::nullopt;
  const Vec3 x = p + from / (from - to) * (q - p);
  if (dot(cross(b - a, x - a), n) < 0 || dot(cross(c - b, x - b), n) < 0 || dot(cross(a - c, x - c), n) < 0)
    return std::nullopt;
  return x;
}

double distance_of_segment_to_triangle(Vec3 p, Vec3 q, Vec3 a, Vec3 b, Vec3 c) {
  if (crossing(p, q, a, b, c)) return 0;
  return std::min({distance_to_triangle(p, a, b, c), distance_to_triangle(q, a, b, c), distance_of_segments(p, q, a, b),
                   distance_of_segments(p, q, b, c), distance_of_segments(p, q, c, a)});
}

// The two triangles of a quad; those of a triangle given with its last corner twice are one.
template <class Visit>
void each_triangle(const Vec3* quad, Visit visit) {
  visit(quad[0], quad[1], quad[2]);
  visit(quad[0], quad[2], quad[3]);
}
double distance_to_quad(Vec3 x, const Vec3* quad) {
  double least = std::numeric_limits<double>::infinity();
  each_triangle(quad, [&](Vec3 a, Vec3 b, Vec3 c) { least = std::min(least, distance_to_triangle(x, a, b, c)); });
  return least;
}
double distance_of_segment_to_quad(Vec3 p, Vec3 q, const Vec3* quad) {
  double least = std::numeric_limits<double>::infinity();
  each_triangle(
      quad, [&](Vec3 a, Vec3 b, Vec3 c) { least = std::min(least, distance_of_segment_to_triangle(p, q, a, b, c)); });
  return least;
}
std::optional<Vec3> crossing_of_quad(Vec3 p, Vec3 q, const Vec3* quad) {
  std::optional<Vec3> found;
  each_triangle(quad, [&](Vec3 a, Vec3 b, Vec3 c) {
    if (!found) found = crossing(p, q, a, b, c);
  });
  return found;
}

bool is_one(const Vec3* quad) {
  return std::all_of(quad, quad + 4,
                     [](Vec3 x) { return std::isfinite(x.x) && std::isfinite(x.y) && std::isfinite(x.z); });
}

// Whether a sweep goes on over a border: the border lies on one of the quad's, within `near`.
bool goes_on(Vec3 a, Vec3 b, const Vec3* quad, double near) {
  for (int k = 0; k < 4; ++k) {
    const Vec3 p = quad[k], q = quad[(k + 1) % 4];
    if (distance_of_segments(a, a, p, q) <= near && distance_of_segments(b, b, p, q) <= near) return true;
  }
  return false;
}

}  // namespace

std::optional<std::vector<std::array<int32_t, 2>>> tissue_at_rest(std::span<const Vec3> rest, double h) {
  using Key = std::array<int64_t, 3>;
  const auto key_of = [&](Vec3 x) {
    return Key{std::llround(std::floor(x.x / h)), std::llround(std::floor(x.y / h)), std::llround(std::floor(x.z / h))};
  };
  std::map<Key, std::vector<int32_t>> boxes;
  for (std::size_t i = 0; i < rest.size(); ++i) {
    if (is_blank(rest[i])) continue;
    if (!(std::max({std::abs(rest[i].x), std::abs(rest[i].y), std::abs(rest[i].z)}) < kFarthestInSpacings * h))
      return std::nullopt;
    std::vector<int32_t>& box = boxes[key_of(rest[i])];
    box.push_back(static_cast<int32_t>(i));
    if (box.size() > kMostWithinSpacing) return std::nullopt;
  }
  std::vector<std::array<int32_t, 2>> joined;
  for (std::size_t i = 0; i < rest.size(); ++i) {
    if (is_blank(rest[i])) continue;
    const Key key = key_of(rest[i]);
    for (int64_t k = 0; k < 125; ++k) {
      const auto box = boxes.find({key[0] + k % 5 - 2, key[1] + k / 5 % 5 - 2, key[2] + k / 25 - 2});
      if (box == boxes.end()) continue;
      for (const int32_t j : box->second) {
        if (j <= static_cast<int32_t>(i)) continue;
        const Vec3 d = rest[at(j)] - rest[i];
        const double a = std::abs(d.x), b = std::abs(d.y), c = std::abs(d.z);
        const double along = std::max({a, b, c}), across = a + b + c - along;
        if (along <= 1.1 * h && across <= 0.2 * h) joined.push_back({static_cast<int32_t>(i), j});
      }
    }
  }
  return joined;
}

std::vector<std::array<int32_t, 2>> tissue_of_cells(std::span<const int32_t> cells, int corners) {
  const auto units = static_cast<int32_t>(std::ssize(cells) / corners);
  constexpr int kNone = -1;
  constexpr int kOfTetrahedron[4][4] = {{0, 1, 2, kNone}, {0, 1, 3, kNone}, {0, 2, 3, kNone}, {1, 2, 3, kNone}};
  constexpr int kOfHexahedron[6][4] = {{0, 1, 2, 3}, {4, 5, 6, 7}, {0, 1, 5, 4},
                                       {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}};
  std::map<std::array<int32_t, 4>, int32_t> open;
  std::vector<std::array<int32_t, 2>> joined;
  for (int32_t cell = 0; cell < units; ++cell) {
    for (int side = 0; side < (corners == 4 ? 4 : 6); ++side) {
      std::array<int32_t, 4> face;
      for (std::size_t k = 0; k < 4; ++k) {
        const int corner = corners == 4 ? kOfTetrahedron[side][k] : kOfHexahedron[side][k];
        face[k] = corner == kNone ? kNone : cells[at(cell) * at(corners) + at(corner)];
      }
      std::sort(face.begin(), face.end());
      const auto [other, is_new] = open.emplace(face, cell);
      if (!is_new) joined.push_back({other->second, cell});
    }
  }
  return joined;
}

SweptTissue::SweptTissue(int32_t units, std::vector<std::array<int32_t, 2>> joined)
    : gone_(at(units)), beside_(at(units)) {
  for (const auto& [a, b] : joined) edges_.push_back({a, b});
}

void SweptTissue::sweep(std::span<const Vec3> quads, std::span<const Vec3> was, std::span<const Vec3> is, double blur) {
  std::vector<Vec3> swept;
  for (std::size_t k = 0; k + 4 <= quads.size(); k += 4) {
    if (is_one(&quads[k])) swept.insert(swept.end(), &quads[k], &quads[k] + 4);
  }
  if (swept.empty()) return;
  Vec3 low = swept.front(), high = low;
  for (const Vec3 x : swept) {
    for (int axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], x[axis]);
      high[axis] = std::max(high[axis], x[axis]);
    }
  }
  const auto is_far = [&](std::initializer_list<Vec3> places, double by) {
    for (int axis = 0; axis < 3; ++axis) {
      double least = std::numeric_limits<double>::infinity(), most = -least;
      for (const Vec3 x : places) {
        least = std::min(least, x[axis]);
        most = std::max(most, x[axis]);
      }
      if (most < low[axis] - by || least > high[axis] + by) return true;
    }
    return false;
  };
  // The sweep lies where the tissue around it is at the end. What that does as a whole in the meantime moves nothing
  // against the blade.
  Vec3 common;
  double near = 0;
  const double size = norm(high - low);
  for (std::size_t i = 0; i < beside_.size(); ++i) {
    if (gone_[i] != 0 || is_far({is[i]}, size)) continue;
    common += is[i] - was[i];
    ++near;
  }
  if (near > 0) common = common / near;
  std::vector<Vec3> moved(was.begin(), was.end());
  for (Vec3& x : moved) x += common;
  for (std::size_t i = 0; i < beside_.size(); ++i) {
    const double by = blur + norm(is[i] - moved[i]);
    if (gone_[i] != 0 || beside_[i] != 0 || is_far({moved[i], is[i]}, by)) continue;
    for (std::size_t k = 0; k < swept.size(); k += 4) {
      if (std::min(distance_to_quad(moved[i], &swept[k]), distance_to_quad(is[i], &swept[k])) <= by) beside_[i] = 1;
    }
  }
  for (Edge& edge : edges_) {
    const std::size_t i = at(edge.a), j = at(edge.b);
    if (edge.state == Edge::State::surely || gone_[i] != 0 || gone_[j] != 0) continue;
    const double by = blur + std::max(norm(is[i] - moved[i]), norm(is[j] - moved[j]));
    if (is_far({moved[i], moved[j], is[i], is[j]}, by)) continue;
    cut(edge, swept, moved, is, by);
  }
  last_ = std::move(swept);
}

void SweptTissue::cut(Edge& edge, std::span<const Vec3> quads, std::span<const Vec3> was, std::span<const Vec3> is,
                      double blur) {
  const Vec3 a = was[at(edge.a)], b = was[at(edge.b)], c = is[at(edge.a)], d = is[at(edge.b)];
  const bool was_whole = edge.state == Edge::State::whole;
  // Borders at which an earlier sweep ended may be gone on with now.
  const auto is_gone_on = [&](const Border& border) {
    for (std::size_t k = 0; k < quads.size(); k += 4) {
      if (goes_on(border.a, border.b, &quads[k], blur)) return true;
    }
    return false;
  };
  if (!edge.near.empty()) {
    std::erase_if(edge.near, is_gone_on);
    if (edge.near.empty()) edge.state = Edge::State::surely;
  }
  for (std::size_t k = 0; k < quads.size() && edge.state != Edge::State::surely; k += 4) {
    const Vec3* const quad = &quads[k];
    if (std::min(distance_of_segment_to_quad(a, b, quad), distance_of_segment_to_quad(c, d, quad)) > blur) continue;
    edge.state = Edge::State::perhaps;
    const std::optional<Vec3> first = crossing_of_quad(a, b, quad), last = crossing_of_quad(c, d, quad);
    if (!first || !last) continue;
    std::vector<Border> near;
    for (int side = 0; side < 4; ++side) {
      const Vec3 p = quad[side], q = quad[(side + 1) % 4];
      if (std::min(distance_of_segments(*first, *first, p, q), distance_of_segments(*last, *last, p, q)) > blur)
        continue;
      bool goes = false;
      for (std::size_t other = 0; other < quads.size(); other += 4) {
        goes |= other != k && goes_on(p, q, &quads[other], blur);
      }
      for (std::size_t earlier = 0; earlier < last_.size(); earlier += 4) goes |= goes_on(p, q, &last_[earlier], blur);
      if (!goes) near.push_back({p, q});
    }
    if (near.empty())
      edge.state = Edge::State::surely;
    else
      edge.near = std::move(near);
  }
  if (edge.state == Edge::State::surely) {
    ++surely_;
    perhaps_ -= was_whole ? 0 : 1;
    edge.near.clear();
  } else if (edge.state == Edge::State::perhaps && was_whole) {
    ++perhaps_;
    ++ever_perhaps_;
  }
}

SweptTissue::Pieces SweptTissue::pieces(bool sure) const {
  DisjointSets sets(static_cast<int64_t>(gone_.size()));
  for (const Edge& edge : edges_) {
    if (gone_[at(edge.a)] != 0 || gone_[at(edge.b)] != 0) continue;
    if (edge.state == Edge::State::whole || (sure && edge.state == Edge::State::perhaps)) sets.unite(edge.a, edge.b);
  }
  Pieces found;
  found.label.assign(gone_.size(), -1);
  for (std::size_t i = 0; i < gone_.size(); ++i) {
    if (gone_[i] != 0) continue;
    const auto root = static_cast<std::size_t>(sets.find(static_cast<int32_t>(i)));
    found.label[i] = root == i ? found.count++ : found.label[root];
  }
  return found;
}

}  // namespace cutproof::oracles
