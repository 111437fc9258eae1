// The skin as a surface at rest (method.md §8), by CGAL. With surface_distance.cpp the only files of the oracles that
// include it.
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/connected_components.h>
#include <CGAL/Polygon_mesh_processing/repair_degeneracies.h>
#include <CGAL/Polygon_mesh_processing/self_intersections.h>
#include <CGAL/Surface_mesh.h>
#include <fmt/format.h>

#include <array>
#include <optional>
#include <utility>

#include "oracles/checks.h"
#include "oracles/piece_sizes.h"
#include "oracles/shape_sums.h"
#include "oracles/surface/surface.h"
#include "oracles/surface/tissue_volume.h"

namespace cutproof::oracles {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Mesh = CGAL::Surface_mesh<Kernel::Point_3>;
namespace pmp = CGAL::Polygon_mesh_processing;

// [node_count] 1 where an alive particle sits.
std::vector<uint8_t> tissue_nodes(const Body& body, const State& state) {
  std::vector<uint8_t> tissue(at(body.grid.node_count()), 0);
  for (std::size_t i = 0; i < body.node.size(); ++i) tissue[at(body.node[i])] = state.alive[i];
  return tissue;
}

// Nothing if the triangles are not those of a manifold with boundary.
std::optional<Mesh> mesh_of(const Skin& skin, const std::vector<Vec3>& points) {
  const auto vertex_count = static_cast<int32_t>(points.size());
  Mesh mesh;
  for (const Vec3 p : points) mesh.add_vertex({p.x, p.y, p.z});
  for (const auto& [a, b, c] : skin.triangles) {
    if (std::min({a, b, c}) < 0 || std::max({a, b, c}) >= vertex_count || a == b || b == c || c == a) {
      return std::nullopt;
    }
    const auto vertex = [](int32_t v) { return Mesh::Vertex_index(static_cast<uint32_t>(v)); };
    if (mesh.add_face(vertex(a), vertex(b), vertex(c)) == Mesh::null_face()) return std::nullopt;
  }
  return mesh;
}

struct MeshShell {
  double volume = 0;     // signed [cube of the unit of `points`]
  double magnitude = 0;  // sum of the absolute terms of that sum, for its rounding bound
  int64_t euler = 0;     // V − E + F
  int64_t triangles = 0;
  int32_t some_vertex = -1;
};

// Volume of a closed surface as the sum over its triangles of projected area times mean height: with vertices at
// multiples of 1/2 every term is exact.
std::vector<MeshShell> shells_of(Mesh& mesh, const Skin& skin, const std::vector<Vec3>& points) {
  auto label = mesh.add_property_map<Mesh::Face_index, std::size_t>("f:shell", 0).first;
  std::vector<MeshShell> shells(pmp::connected_components(mesh, label));
  std::vector<uint8_t> counted(points.size(), 0);
  for (std::size_t t = 0; t < skin.triangles.size(); ++t) {
    MeshShell& shell = shells[label[Mesh::Face_index(static_cast<uint32_t>(t))]];
    const auto& triangle = skin.triangles[t];
    const Vec3 a = points[at(triangle[0])], b = points[at(triangle[1])] - a, c = points[at(triangle[2])] - a;
    const double height = 3 * a.z + b.z + c.z;
    shell.volume += height * (b.x * c.y - b.y * c.x);
    shell.magnitude += std::abs(height) * (std::abs(b.x * c.y) + std::abs(b.y * c.x));
    ++shell.triangles;
    shell.some_vertex = triangle[0];
    for (const int32_t v : triangle) {
      if (std::exchange(counted[at(v)], uint8_t{1}) == 0) ++shell.euler;
    }
  }
  for (MeshShell& shell : shells) {
    shell.volume /= 6;
    shell.magnitude /= 6;
    shell.euler += shell.triangles - 3 * shell.triangles / 2;
  }
  return shells;
}

// Every vertex where it is at rest, in units of h.
std::vector<Vec3> rest_points(const Setup& setup, const Skin& skin) {
  std::vector<Vec3> points(skin.owner.size());
  for (std::size_t v = 0; v < points.size(); ++v) {
    const auto node = setup.body.grid.coordinates(setup.body.node[at(skin.owner[v])]);
    const auto& step = kDirections[skin.direction[v]];
    for (int axis = 0; axis < 3; ++axis) {
      const auto i = at(axis);
      points[v][axis] = node[i] + skin.reach[v] * step[i];
    }
  }
  return points;
}

// CGAL joins triangles at their edges; "skin match" joins them at their vertices.
void check_skin_shells(Judged& judged, Verdict& verdict) {
  const Skin& skin = judged.state.skin;
  if (!has_skin(judged.state)) return;  // where there must be one, "skin surface" says so
  verdict.checked = static_cast<int64_t>(skin.triangles.size());
  const ShellCount joined = count_shells(skin);
  const std::optional<ShellCount> counted = skin_shells(skin);
  if (!counted) {
    violate(verdict, {}, "the triangles do not join to a surface, so its shells cannot be counted");
  } else if (counted->outer + counted->inner != joined.outer + joined.inner) {
    violate(verdict, {},
            "where triangles join at edges the skin has {} shells, and where they join at vertices {}: shells touch",
            counted->outer + counted->inner, joined.outer + joined.inner);
  }
}

void check_skin_geometry(Judged& judged, Verdict& verdict) {
  const Setup& setup = judged.setup;
  const State& state = judged.state;
  const Skin& skin = state.skin;
  verdict.checked = static_cast<int64_t>(skin.triangles.size());
  if (!has_skin(state) && !skin_is_missing(setup, state)) return;
  const Verdict surface = ask(property_named(core_properties(), "skin surface"), judged);
  if (!surface.holds) {
    return fail(verdict, {}, "{}: the skin is not a closed surface ({})", kNotJudged, surface.witness.text);
  }
  const auto vertices_of = [&](Mesh::Face_index face) {
    const auto& t = skin.triangles[at(face)];
    return std::vector<int32_t>{t.begin(), t.end()};
  };

  const std::vector<Vec3> points = rest_points(setup, skin);
  std::optional<Mesh> mesh = mesh_of(skin, points);
  if (!mesh) return fail(verdict, {}, "{}: the triangles do not join to a surface", kNotJudged);

  std::vector<Mesh::Face_index> degenerate;
  pmp::degenerate_faces(*mesh, std::back_inserter(degenerate));
  if (!degenerate.empty()) {
    verdict.measured = static_cast<double>(degenerate.size());
    return fail(verdict, owners_of(skin, vertices_of(degenerate[0]), {static_cast<int32_t>(degenerate[0])}),
                "triangle {} has no area at rest", static_cast<uint32_t>(degenerate[0]));
  }
  std::vector<std::pair<Mesh::Face_index, Mesh::Face_index>> crossing;
  pmp::self_intersections(*mesh, std::back_inserter(crossing));
  if (!crossing.empty()) {
    verdict.measured = static_cast<double>(crossing.size());
    auto vertices = vertices_of(crossing[0].first);
    for (const int32_t v : vertices_of(crossing[0].second)) vertices.push_back(v);
    const auto one = static_cast<int32_t>(crossing[0].first), other = static_cast<int32_t>(crossing[0].second);
    return fail(verdict, owners_of(skin, vertices, {one, other}), "triangles {} and {} intersect at rest", one, other);
  }

  double volume = 0, magnitude = 0;
  int32_t outer = 0, inner = 0;
  for (const MeshShell& shell : shells_of(*mesh, skin, points)) {
    volume += shell.volume;
    magnitude += shell.magnitude;
    (shell.volume > 0 ? outer : inner) += 1;
    if (shell.euler % 2 != 0 || shell.euler > 2) {
      verdict.measured = static_cast<double>(shell.euler);
      return fail(verdict, owners_of(skin, {shell.some_vertex}),
                  "a shell has Euler number {}, which no closed surface has", shell.euler);
    }
  }
  const std::vector<uint8_t> tissue = tissue_nodes(setup.body, state);
  const int32_t components = judged.components().count, cavities = count_cavities(judged);
  if (outer != components || inner != cavities) {
    verdict.measured = std::abs(outer - components) + std::abs(inner - cavities);
    return fail(verdict, {},
                "the skin has {} outward and {} inward shells, and the tissue has {} components and {} "
                "cavities; the tissue is {}",
                outer, inner, components, cavities, pieces_in_words(judged.components()));
  }

  const VolumeRange range = tissue_volume(setup, skin, tissue);
  const auto triangles = static_cast<double>(skin.triangles.size());
  // The terms of both bounds, added cell by cell, where vertices have places of their own (tolerances.md).
  const double cells = lie_alike(skin) ? 0 : 1.25 * triangles;
  const double rounding = (triangles + 512) * kUnitRoundoff * (magnitude + std::abs(range.high) + cells);
  const double outside = std::max(range.low - volume, volume - range.high);
  verdict.measured = std::max(0.0, outside);
  verdict.bound = rounding;
  verdict.unit = "h³";
  if (!(outside <= rounding)) {
    return fail(verdict, {}, "the skin holds {} h³, and this tissue between {} and {} h³",
                figure_beside(volume, volume < range.low ? range.low : range.high), figure_beside(range.low, volume),
                figure_beside(range.high, volume));
  }
}

}  // namespace

std::optional<ShellCount> skin_shells(const Skin& skin) {
  std::optional<Mesh> mesh = mesh_of(skin, skin.position);
  if (!mesh) return std::nullopt;
  ShellCount count;
  for (const MeshShell& shell : shells_of(*mesh, skin, skin.position)) {
    (shell.volume > 0 ? count.outer : count.inner) += 1;
  }
  return count;
}

const PropertyList& surface_properties() {
  const auto thorough = [](Property property) {
    property.cost = Cost::thorough;
    return property;
  };
  static const PropertyList list = {
      thorough(of_state("skin shells", "method.md §8, lemma: counted a second time", "1", kSkin, kSkinThere, "no skin",
                        check_skin_shells)),
      thorough(of_state("skin geometry", "method.md §8, lemma; tolerances.md, Volume of the skin", "1", kAlive | kSkin,
                        kSkinThere, "no skin", check_skin_geometry))};
  return list;
}

PropertyLists properties() { return {&core_properties(), &motion_properties(), &surface_properties()}; }

}  // namespace cutproof::oracles
