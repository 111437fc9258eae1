// Meshes, one target per format: what is read bounds a solid.
#include <fmt/format.h>

#include <cmath>
#include <map>
#include <set>
#include <tuple>
#include <utility>

#include "tests/fixtures/mesh_files.h"
#include "tests/input_fuzzing/targets.h"

namespace cutproof::input_fuzzing {
namespace {

using fixtures::Polygons;
using fixtures::SurfaceMesh;

// Six times the volume, from an apex in the surface, so that a body far from the origin loses no digits.
double six_volumes(const SurfaceMesh& mesh) {
  double sum = 0;
  const Vec3 apex = mesh.points.front();
  for (const auto& t : mesh.triangles) {
    const auto corner = [&](std::size_t i) { return mesh.points[static_cast<std::size_t>(t[i])] - apex; };
    sum += dot(corner(0), cross(corner(1), corner(2)));
  }
  return sum;
}

void require_solid(const SurfaceMesh& mesh) {
  for (const bool align : {false, true}) {
    const fixtures::Solid solid = fixtures::solid_from_mesh(mesh, align);
    const Mat3& r = solid.world_orientation;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        double product = 0;
        for (int k = 0; k < 3; ++k) product += r(k, i) * r(k, j);
        // Written so that NaN fails.
        if (!(std::abs(product - (i == j ? 1 : 0)) < 1e-9)) broken_contract("the axes of a solid are not orthonormal");
      }
      if (!(solid.bounds.low[i] < solid.bounds.high[i])) broken_contract("a solid has no extent");
    }
    if (!(solid.volume > 0) || !is_finite(solid.world_origin) || !is_finite(solid.bounds.low) ||
        !is_finite(solid.bounds.high)) {
      broken_contract("a solid has no volume or no place");
    }
  }
}

// Read as it is, then with repair: what is accepted is sound, and repair accepts what is sound as it is.
Outcome feed(const std::string& file, std::string_view bytes) {
  write_scratch(file, bytes);
  const auto read = [&](bool is_repaired) {
    return outcome_of([&] {
      const SurfaceMesh mesh = fixtures::read_mesh(scratch_path(file), 0.001, {is_repaired, 1});
      if (const auto defect = defect_of(mesh)) broken_contract("a mesh was read that is not sound: " + *defect);
      require_solid(mesh);
      if (is_repaired && !mesh.repair) broken_contract("a mesh was repaired in silence");
    });
  };
  const Outcome outcome = read(false);
  if (read(true) == Outcome::refused && outcome == Outcome::read) broken_contract("repair refuses a sound mesh");
  return outcome;
}

// A box, a box whose sides are polygons of four corners, and one with a cavity.
std::vector<Polygons> bodies() {
  Polygons quads = fixtures::box({-1, 0, 2}, {3, 1, 2.5});
  quads.faces = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  const Polygons hollow = fixtures::together(
      fixtures::cube(), fixtures::turned_inside_out(fixtures::box({0.25, 0.25, 0.25}, {0.5, 0.5, 0.5})));
  return {fixtures::cube(), quads, hollow};
}

// `write` gives the file of one body.
template <class F>
std::vector<std::string> seeds_of(F&& write) {
  std::vector<std::string> seeds;
  for (const Polygons& body : bodies()) seeds.push_back(write(body));
  return seeds;
}

// An STL has triangles only.
Polygons in_triangles(const Polygons& body) {
  Polygons triangles{body.points, {}};
  for (const auto& face : body.faces) {
    for (std::size_t i = 1; i + 1 < face.size(); ++i) triangles.faces.push_back({face[0], face[i], face[i + 1]});
  }
  return triangles;
}

std::vector<std::string> operator+(std::vector<std::string> a, const std::vector<std::string>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

Outcome feed_stl(std::string_view bytes) { return feed("mesh.stl", bytes); }
Outcome feed_obj(std::string_view bytes) { return feed("mesh.obj", bytes); }
Outcome feed_ply(std::string_view bytes) { return feed("mesh.ply", bytes); }
Outcome feed_off(std::string_view bytes) { return feed("mesh.off", bytes); }

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size())) {
    text.replace(at, from.size(), to);
  }
  return text;
}

// Two bytes behind each triangle, as its attribute count says.
std::string with_attributes(const std::string& stl) {
  constexpr std::size_t kHeader = 84, kTriangle = 50;
  std::string out = stl.substr(0, kHeader);
  for (std::size_t at = kHeader; at < stl.size(); at += kTriangle) {
    out += stl.substr(at, kTriangle - 2) + std::string("\2\0ab", 4);
  }
  return out;
}

// The cube, of one strip around its sides and one over bottom and top.
std::string of_strips(const std::string& text_ply) {
  return replaced(text_ply.substr(0, text_ply.find("3 0 2 3")), "element face 12\nproperty list uchar int",
                  "element tristrips 2\nproperty list int int") +
         "10 0 4 1 5 3 7 2 6 0 4\n9 0 1 2 3 -1 4 6 5 7\n";
}

std::vector<std::string> stl_seeds() {
  const std::string text = fixtures::as_text_stl(fixtures::cube()), bytes = fixtures::as_binary_stl(fixtures::cube());
  return seeds_of([](const Polygons& body) { return fixtures::as_text_stl(in_triangles(body)); }) +
         seeds_of([](const Polygons& body) { return fixtures::as_binary_stl(in_triangles(body)); }) +
         std::vector<std::string>{with_attributes(bytes), bytes + "\n", replaced(text, "\n    ", " "),
                                  "\xef\xbb\xbf" + replaced(text, "\n", "\r")};
}
std::vector<std::string> obj_seeds() {
  const std::string text = fixtures::as_obj(fixtures::cube());
  return seeds_of(fixtures::as_obj) +
         std::vector<std::string>{"\xef\xbb\xbf" + text.substr(text.find("v ")),
                                  replaced("# C:\\\n" + text, "v 0 1 0", "v +0.D0 \\\r1 0 1")};
}
std::vector<std::string> ply_seeds() {
  return seeds_of(fixtures::as_text_ply) +
         seeds_of([](const Polygons& body) { return fixtures::as_binary_ply(body, false); }) +
         seeds_of([](const Polygons& body) { return fixtures::as_binary_ply(body, true); }) +
         std::vector<std::string>{
             of_strips(fixtures::as_text_ply(fixtures::cube())),
             replaced(fixtures::as_text_ply(fixtures::cube()), "list uchar int", "list uint64 int8")};
}
std::vector<std::string> off_seeds() {
  const std::string text = fixtures::as_off(fixtures::cube());
  std::string four_coordinates = "4OFF\n8 12 0\n";
  for (const Vec3& p : fixtures::cube().points) {
    for (int axis = 0; axis < 3; ++axis) fixtures::append_number(four_coordinates += " ", p[axis]);
    four_coordinates += " 2\n";
  }
  return seeds_of([](const Polygons& body) { return fixtures::as_off(body); }) +
         std::vector<std::string>{replaced(text, "OFF\n8", "OFF8"),
                                  four_coordinates + text.substr(text.find("3 0 2 3"))};
}

}  // namespace

std::optional<std::string> defect_of(const SurfaceMesh& mesh) {
  const auto count = static_cast<int32_t>(mesh.points.size());
  std::set<std::tuple<double, double, double>> places;
  for (const Vec3& p : mesh.points) {
    if (!is_finite(p)) return "a point is not finite";
    if (!places.emplace(p.x, p.y, p.z).second) return "two points are one";
  }
  std::set<int32_t> used;
  std::map<std::pair<int32_t, int32_t>, int> sides;  // how often from one point to another
  for (const auto& t : mesh.triangles) {
    for (std::size_t i = 0; i < 3; ++i) {
      if (t[i] < 0 || t[i] >= count) return fmt::format("a triangle names the point {} of {}", t[i], count);
      used.insert(t[i]);
      ++sides[{t[i], t[(i + 1) % 3]}];
    }
  }
  if (used.empty()) return "there are no triangles";
  if (used.size() != mesh.points.size()) return "a point belongs to no triangle";
  for (const auto& [side, times] : sides) {
    const auto back = sides.find({side.second, side.first});
    if (side.first == side.second || times != 1 || back == sides.end()) {
      return fmt::format("the edge from point {} to {} is not one of two triangles oriented alike", side.first,
                         side.second);
    }
  }
  const double volume = six_volumes(mesh);
  if (!(volume > 0)) return fmt::format("the volume is {}", volume / 6);
  return std::nullopt;
}

const Target kStl = {"stl", feed_stl, stl_seeds};
const Target kObj = {"obj", feed_obj, obj_seeds};
const Target kPly = {"ply", feed_ply, ply_seeds};
const Target kOff = {"off", feed_off, off_seeds};

}  // namespace cutproof::input_fuzzing
