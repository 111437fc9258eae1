#include "oracles/comparison/interpenetration.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <tuple>
#include <vector>

#include "oracles/comparison/lattice_lines.h"
#include "oracles/eigen.h"
#include "oracles/oracles.h"
#include "oracles/support.h"

namespace cutproof::oracles {

namespace {

using Box = Eigen::AlignedBox3d;

Box box_of(const Triangle& t) {
  Box box;  // empty
  for (const Vec3 corner : t) box.extend(as_eigen(corner));
  return box;
}

// The skins of the components of G, as triangles with their component.
struct Pieces {
  std::vector<Triangle> triangles;
  std::vector<int32_t> component;
  int32_t count = 0;
  bool in_order = true;  // every triangle belongs to a component and lies somewhere
};

Pieces pieces_of(const Setup& setup, const State& state) {
  Pieces pieces;
  pieces.in_order = well_formed(setup, state).holds;
  if (!pieces.in_order) return pieces;
  const Partition partition = graph_components(setup, state);
  pieces.count = partition.count;
  for (const auto& [a, b, c] : state.skin.triangles) {
    const Skin& skin = state.skin;
    pieces.triangles.push_back({skin.position[at(a)], skin.position[at(b)], skin.position[at(c)]});
    pieces.component.push_back(partition.label[at(skin.owner[at(a)])]);
    pieces.in_order = pieces.in_order && pieces.component.back() >= 0 && is_finite(skin.position[at(a)]) &&
                      is_finite(skin.position[at(b)]) && is_finite(skin.position[at(c)]);
  }
  return pieces;
}

// Where more than one component may be: around the intersection of the boxes of two. Empty if there is none.
Box shared_region(const Pieces& pieces) {
  std::vector<Box> box(at(pieces.count));
  for (std::size_t t = 0; t < pieces.triangles.size(); ++t) {
    box[at(pieces.component[t])].extend(box_of(pieces.triangles[t]));
  }
  Box region;
  for (std::size_t a = 0; a < box.size(); ++a) {
    for (std::size_t b = 0; b < a; ++b) {
      const Box shared = box[a].intersection(box[b]);
      if (shared.sizes().minCoeff() > 0) region.extend(shared);
    }
  }
  return region;
}

// A part of a line, or of the column around it, in which a component is, or its skin.
struct Stretch {
  int64_t line;
  double low, high;
  int32_t component;
  bool skin;  // else: the line is inside the component
};

// Lines that divide the region evenly, at most `spacing` apart.
Lattice lattice_over(const Box& region, int axis, double spacing) {
  Lattice lattice{axes_of(axis), {}, {}, {}};
  for (int w = 0; w < 2; ++w) {
    const int k = w == 0 ? lattice.axes.u : lattice.axes.v;
    lattice.first[at(w)] = region.min()[k];
    const double width = region.sizes()[k];
    lattice.count[at(w)] = static_cast<int64_t>(std::ceil(width / spacing));
    lattice.spacing[at(w)] = width / static_cast<double>(lattice.count[at(w)]);
  }
  return lattice;
}

// Inside is where the skin has been entered more often than left.
void add_insides(const Pieces& pieces, const Lattice& lattice, std::vector<Stretch>& stretches) {
  struct Entry {
    int64_t line;
    int32_t component;
    double at;
    int step;  // +1: enters, going up
  };
  std::vector<Entry> entries;
  for (std::size_t t = 0; t < pieces.triangles.size(); ++t) {
    cross_lines(lattice, pieces.triangles[t], [&](const Crossing& c) {
      entries.push_back({c.line, pieces.component[t], c.at, c.normal < 0 ? +1 : -1});
    });
  }
  std::sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) {
    return std::tie(a.line, a.component, a.at) < std::tie(b.line, b.component, b.at);
  });
  int winding = 0;
  for (std::size_t k = 0; k + 1 < entries.size(); ++k) {
    const Entry &here = entries[k], &next = entries[k + 1];
    winding += here.step;
    if (here.line != next.line || here.component != next.component) {
      winding = 0;
    } else if (winding > 0 && next.at > here.at) {
      stretches.push_back({here.line, here.at, next.at, here.component, false});
    }
  }
}

// Where triangles pass through columns: no less than they do. Over the column's square the triangle's plane lies within
// |n_u| s_u / 2 + |n_v| s_v / 2 of its height over the middle, times |n_axis|.
void add_skins(const Pieces& pieces, const Lattice& lattice, std::vector<Stretch>& stretches) {
  const auto [axis, u, v] = lattice.axes;
  for (std::size_t t = 0; t < pieces.triangles.size(); ++t) {
    const Triangle& triangle = pieces.triangles[t];
    const Box box = box_of(triangle);
    const Vec3 n = cross(triangle[1] - triangle[0], triangle[2] - triangle[0]);
    const double half = (std::abs(n[u]) * lattice.spacing[0] + std::abs(n[v]) * lattice.spacing[1]) / 2;
    std::array<int64_t, 2> first, end;
    for (std::size_t w = 0; w < 2; ++w) {
      const int k = w == 0 ? u : v;
      const auto most = static_cast<double>(lattice.count[w]);
      const auto column = [&](double x) { return (x - lattice.first[w]) / lattice.spacing[w]; };
      first[w] = static_cast<int64_t>(std::clamp(std::floor(column(box.min()[k])), 0.0, most));
      end[w] = static_cast<int64_t>(std::clamp(std::floor(column(box.max()[k])) + 1, 0.0, most));
    }
    for (int64_t j = first[1]; j < end[1]; ++j) {
      for (int64_t i = first[0]; i < end[0]; ++i) {
        // On the plane: n_axis (z − z0) = −aside, up to half.
        const double aside =
            n[u] * (lattice.place(0, i) - triangle[0][u]) + n[v] * (lattice.place(1, j) - triangle[0][v]);
        double low = box.min()[axis], high = box.max()[axis];
        if (n[axis] == 0) {
          if (std::abs(aside) > half) continue;
        } else {
          const double middle = triangle[0][axis] - aside / n[axis], reach = half / std::abs(n[axis]);
          low = std::max(low, middle - reach);
          high = std::min(high, middle + reach);
        }
        if (low < high) stretches.push_back({i + lattice.count[0] * j, low, high, pieces.component[t], true});
      }
    }
  }
}

// Lengths, over all lines, inside more than one component, and of the uncertain part: where more than one component is
// present and a skin passes through the column around the line.
struct Lengths {
  double shared = 0, doubtful = 0;
};
Lengths lengths_of(std::vector<Stretch> stretches, int32_t components) {
  std::sort(stretches.begin(), stretches.end(), [](const Stretch& a, const Stretch& b) { return a.line < b.line; });
  struct End {
    double at;
    int step;
    int32_t component;
    bool skin;
  };
  std::vector<std::array<int32_t, 2>> depth(at(components));  // inside, skin
  Lengths lengths;
  std::vector<End> ends;
  for (std::size_t begin = 0, end; begin < stretches.size(); begin = end) {
    ends.clear();
    for (end = begin; end < stretches.size() && stretches[end].line == stretches[begin].line; ++end) {
      const Stretch& s = stretches[end];
      ends.push_back({s.low, +1, s.component, s.skin});
      ends.push_back({s.high, -1, s.component, s.skin});
    }
    std::sort(ends.begin(), ends.end(), [](const End& a, const End& b) { return a.at < b.at; });
    int inside = 0, skins = 0, present = 0;  // how many components
    for (std::size_t k = 0; k < ends.size(); ++k) {
      auto& [in, on] = depth[at(ends[k].component)];
      const bool was_in = in > 0, was_on = on > 0;
      (ends[k].skin ? on : in) += ends[k].step;
      inside += (in > 0) - was_in;
      skins += (on > 0) - was_on;
      present += (in > 0 || on > 0) - (was_in || was_on);
      if (k + 1 == ends.size()) break;
      const double length = ends[k + 1].at - ends[k].at;
      if (inside > 1) lengths.shared += length;
      if (present > 1 && skins > 0) lengths.doubtful += length;
    }
  }
  return lengths;
}

}  // namespace

Interpenetration interpenetration(const Setup& setup, const State& state) {
  const Pieces pieces = pieces_of(setup, state);
  if (!pieces.in_order) {
    return {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()};
  }
  const Box region = shared_region(pieces);
  if (region.isEmpty()) return {};
  const double h = setup.body.grid.spacing, cube = h * h * h;
  Interpenetration best;
  best.bound = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    const Lattice lattice = lattice_over(region, axis, h / kColumnsPerSpacing);
    std::vector<Stretch> stretches;
    add_insides(pieces, lattice, stretches);
    add_skins(pieces, lattice, stretches);
    const Lengths lengths = lengths_of(std::move(stretches), pieces.count);
    const double column = lattice.spacing[0] * lattice.spacing[1] / cube;
    if (lengths.doubtful * column < best.bound) best = {lengths.shared * column, lengths.doubtful * column};
  }
  return best;
}

}  // namespace cutproof::oracles
