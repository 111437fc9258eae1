#include "harness/foreign_state.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <tuple>

#include "model/at.h"
#include "model/bare_graph.h"
#include "model/error.h"

namespace cutproof::harness {

namespace {

using Node = std::array<int32_t, 3>;

// A grid with more nodes than this is handled as a graph: its table of nodes would be larger than the file.
constexpr double kMostGridNodes = 0x1p28;

class Reader {
 public:
  Reader(const io::ArrayFile& contents, const std::string& file)
      : in_(contents, file, foreign_state_arrays(), foreign_state_texts()) {
    for (const Array& array : contents.arrays) out_.given.insert(array.name);
    if (const std::string* const words = io::find_text(contents, "promises")) {
      out_.promises.words = parse_promises(*words, file, "promises");
      out_.promises_given = true;
    }
    if (const std::string* const weights = io::find_text(contents, "weights")) {
      out_.plain_weights = *weights == "plain";
      if (*weights != "plain" && *weights != "shared") {
        in_.refuse("weights", fmt::format("This is '{}'.", *weights),
                   "Write 'shared' (mass / number of containing clusters) or 'plain' (mass).");
      }
    }
  }

  ForeignState read() {
    read_parameters();
    read_particles();
    read_graph();
    read_clusters();
    read_skin();
    if (out_.defect.empty()) move_into_body_frame();
    take_notes();
    return std::move(out_);
  }

 private:
  // The first defect counts.
  template <class... Args>
  void defect(fmt::format_string<Args...> text, Args&&... args) {
    if (out_.defect.empty()) out_.defect = fmt::format(text, std::forward<Args>(args)...);
  }

  int32_t n() const { return static_cast<int32_t>(out_.state.x.size()); }

  double positive(std::string_view name, double value) const {
    if (!(value > 0) || !std::isfinite(value)) {
      in_.refuse(name, fmt::format("This is {}.", value), "Give a positive, finite number.");
    }
    return value;
  }

  // The coarsest precision of the given arrays counts for all.
  void see_type(const Array& array) {
    if (array.type == ElementType::f32) out_.state.precision = Precision::binary32;
  }
  // Of computed arrays. Masses and velocities may be parameters with few digits; rest positions come from meshes, whose
  // files have single precision.
  void see_precision(const Array& array) {
    see_type(array);
    if (array.type == ElementType::f32 || precision_of(array) != Precision::binary32) return;
    out_.state.precision = Precision::binary32;
    widened_.push_back(array.name);
  }
  std::vector<Vec3> vectors(const Array& array) {
    see_precision(array);
    return in_.vectors(array);
  }
  void see_place(Vec3 x) {
    if (is_finite(x)) out_.extent = std::max(out_.extent, norm(x));
  }
  std::vector<Vec3> places(const Array& array) {
    std::vector<Vec3> found = vectors(array);
    for (const Vec3 x : found) see_place(x);
    return found;
  }

  void take_notes() {
    out_.notes = in_.notes();
    if (widened_.empty()) return;
    out_.notes.push_back(
        fmt::format("All numbers of {} are float32 values stored as float64: the state is judged as single precision.",
                    fmt::join(widened_, ", ")));
  }

  void read_parameters() {
    // Nothing is owed by stages to come, and the only rule is that of maximality, where tau and cap say what it means.
    out_.setup.expand.rule = ExpandRule::none;
    out_.setup.skin.wanted = false;
    for (const auto& [name, member] : {std::pair{"tau", &out_.state.tau}, std::pair{"cap", &out_.state.cap}}) {
      const auto value = in_.whole_number(name);
      if (!value) continue;
      if (*value < 0 || *value > std::numeric_limits<int32_t>::max()) {
        in_.refuse(name, fmt::format("This is {}.", *value), "Give a number of particles.");
      }
      *member = static_cast<int32_t>(*value);
    }
    in_.both("tau", "cap");
    if ((out_.pieces = in_.whole_number("pieces")) && *out_.pieces < 0) {
      in_.refuse("pieces", fmt::format("This is {}.", *out_.pieces), "Give the number of pieces of tissue.");
    }
    if (const auto alpha = in_.number("alpha")) {
      if (!(*alpha > 0 && *alpha < 1)) {
        in_.refuse("alpha", fmt::format("This is {}.", *alpha), "Give a number between 0 and 1.");
      }
      out_.setup.skin.alpha = *alpha;
    }
    out_.state.edge_covered = out_.promises.cover("edge cover");
  }

  void read_particles() {
    State& state = out_.state;
    const Array& positions = in_.require("positions", {-1, 3});
    if (positions.rows() > std::numeric_limits<int32_t>::max()) {
      in_.refuse("positions", "There are more particles than 32-bit numbers can name.", "Write a smaller body.");
    }
    state.x = vectors(positions);
    state.v.assign(state.x.size(), {});
    state.alive.assign(state.x.size(), 1);
    if (const Array* const v = in_.find("velocities", {n(), 3})) {
      see_type(*v);
      state.v = in_.vectors(*v);
    }
    if (const Array* const alive = in_.find("alive", {n()})) {
      const std::vector<int64_t> flags = in_.long_integers(*alive);
      // "well formed" rejects other values.
      for (std::size_t i = 0; i < flags.size(); ++i) {
        state.alive[i] = flags[i] == 0 || flags[i] == 1 ? static_cast<uint8_t>(flags[i]) : uint8_t{2};
      }
    }
    for (int32_t i = 0; i < n(); ++i) {  // removed particles may be anywhere
      if (state.alive[at(i)] != 0) see_place(state.x[at(i)]);
    }
    if (const Array* const removed = in_.find("removed", {-1})) {
      state.removed = in_.integers(*removed);
      std::sort(state.removed.begin(), state.removed.end());
      state.removed.erase(std::unique(state.removed.begin(), state.removed.end()), state.removed.end());
    }
    out_.setup.body.mass.assign(state.x.size(), 1.0);
    if (const Array* const mass = in_.find("mass", {n()})) {
      see_type(*mass);
      out_.setup.body.mass = in_.numbers(*mass);
      for (int32_t i = 0; i < n(); ++i) {
        const double m = out_.setup.body.mass[at(i)];
        if (!(m > 0) || !std::isfinite(m)) defect("the mass of particle {} is {}", i, m);
      }
    }
    if (const Array* const rest = in_.find("rest", {n(), 3})) {
      see_type(*rest);
      rest_ = in_.vectors(*rest);
      for (const Vec3 x : rest_) see_place(x);
      for (int32_t i = 0; i < n(); ++i) {
        if (!is_finite(rest_[at(i)])) defect("the rest position of particle {} is not finite", i);
      }
    }
  }

  void read_graph() {
    Body& body = out_.setup.body;
    body.name = "file";
    const bool by_pairs = in_.has("edges"), by_rows = in_.both("edge_offsets", "edge_ends"), by_grid = in_.has("nodes");
    if (by_pairs + by_rows + by_grid != 1) {
      const std::string problem =
          by_pairs + by_rows + by_grid == 0 ? "There is no tissue graph." : "There is more than one tissue graph.";
      in_.refuse("edges", problem, "Give exactly one of: edges; edge_offsets and edge_ends; nodes and spacing.");
    }
    const auto spacing = in_.number("spacing");
    if (spacing) body.grid.spacing = positive("spacing", *spacing);
    if (by_grid) return read_grid();
    if (by_pairs) {
      const std::vector<int32_t> ends = in_.integers(in_.require("edges", {-1, 2}));
      for (std::size_t k = 0; k + 1 < ends.size(); k += 2) add_edge(ends[k], ends[k + 1]);
    } else {
      const std::vector<int64_t> offsets = in_.long_integers(in_.require("edge_offsets", {n() + int64_t{1}}));
      const std::vector<int32_t> ends = in_.integers(in_.require("edge_ends", {-1}));
      const auto count = static_cast<int64_t>(ends.size());
      if (offsets.front() != 0 || offsets.back() != count) {
        defect("edge_offsets run from {} to {}, not from 0 to {}", offsets.front(), offsets.back(), count);
      }
      for (int32_t i = 0; i < n() && out_.defect.empty(); ++i) {
        const int64_t first = offsets[at(i)], end = offsets[at(i + 1)];
        if (end < first || end > count) defect("edge_offsets descend at particle {}", i);
        for (int64_t k = first; k < end && out_.defect.empty(); ++k) add_edge(i, ends[at(k)]);
      }
    }
    make_bare_graph();
    if (!spacing) body.grid.spacing = longest_edge();
  }

  void add_edge(int32_t a, int32_t b) {
    if (a < 0 || a >= n() || b < 0 || b >= n()) {
      defect("an edge leads from particle {} to {}, and there are {} particles", a, b, n());
    } else if (a == b) {
      defect("an edge leads from particle {} to itself", a);
    } else {
      edges_.emplace_back(a, b);
    }
  }

  void make_bare_graph() {
    Body& body = out_.setup.body;
    body.rest = rest_.empty() ? out_.state.x : rest_;
    set_edges(body, edges_);
  }

  double longest_edge() const {
    double longest = 0;
    for (const auto& [a, b] : edges_) {
      const double length = out_.setup.body.rest_length(a, b);
      if (std::isfinite(length)) longest = std::max(longest, length);
    }
    if (!(longest > 0) && out_.defect.empty()) {
      in_.refuse("spacing", "No edge has a positive length.", "Give the spacing: the length of an edge.");
    }
    return longest > 0 ? longest : 1;
  }

  // Nodes that do not ascend as those of a Body do, or that lie far apart, make the same graph without its grid: what
  // needs a grid is the skin alone.
  void read_grid() {
    Body& body = out_.setup.body;
    if (!in_.has("spacing")) {
      in_.refuse("spacing", "This is not there, and nodes are.", "Give the distance of two neighbouring nodes.");
    }
    const std::vector<int32_t> given = in_.integers(in_.require("nodes", {n(), 3}));
    std::vector<Node> nodes(at(n()));
    Node least = {0, 0, 0}, most = {0, 0, 0};
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        nodes[i][axis] = given[3 * i + axis];
        least[axis] = i == 0 ? nodes[i][axis] : std::min(least[axis], nodes[i][axis]);
        most[axis] = i == 0 ? nodes[i][axis] : std::max(most[axis], nodes[i][axis]);
      }
    }
    place_on_grid(nodes, least);
    double node_count = 1;
    for (std::size_t axis = 0; axis < 3; ++axis) node_count *= double{1.0 * most[axis]} - least[axis] + 3;
    const auto below = [](const Node& a, const Node& b) {
      return std::tie(a[2], a[1], a[0]) < std::tie(b[2], b[1], b[0]);
    };
    const bool ascend = std::is_sorted(nodes.begin(), nodes.end(), below);
    std::vector<std::pair<Node, int32_t>> known;
    for (int32_t i = 0; i < n(); ++i) known.emplace_back(nodes[at(i)], i);
    std::sort(known.begin(), known.end());
    for (std::size_t k = 1; k < known.size(); ++k) {
      if (known[k].first != known[k - 1].first) continue;
      defect("particles {} and {} are on the same node", known[k - 1].second, known[k].second);
    }
    if (ascend && node_count <= kMostGridNodes) {
      if (!out_.defect.empty()) return;
      for (std::size_t axis = 0; axis < 3; ++axis) body.grid.nodes[axis] = most[axis] - least[axis] + 3;
      body.particle_at.assign(at(body.grid.node_count()), -1);
      for (int32_t i = 0; i < n(); ++i) {
        const Node& c = nodes[at(i)];
        body.node.push_back(body.grid.index(c[0] - least[0] + 1, c[1] - least[1] + 1, c[2] - least[2] + 1));
        body.particle_at[at(body.node.back())] = i;
      }
      return;
    }
    why_no_grid_ = ascend ? "The grid has more than 2^28 nodes."
                          : "Nodes do not ascend by their last, then their second, then their first coordinate.";
    for (const auto& [node, i] : known) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        Node next = node;
        if (next[axis] == std::numeric_limits<int32_t>::max()) continue;
        ++next[axis];
        const auto found = std::lower_bound(known.begin(), known.end(), std::pair{next, int32_t{-1}});
        if (found != known.end() && found->first == next) add_edge(i, found->second);
      }
    }
    make_bare_graph();
  }

  // Where the file's frame has the body's, and the rest positions that follow from the nodes.
  void place_on_grid(const std::vector<Node>& nodes, const Node& least) {
    const double h = out_.setup.body.grid.spacing;
    const auto place = [h](const Node& c) { return Vec3{h * c[0], h * c[1], h * c[2]}; };
    if (nodes.empty()) return;
    const Vec3 shift = rest_.empty() || !out_.defect.empty() ? Vec3{} : rest_.front() - place(nodes.front());
    const double u = unit_roundoff(out_.state.precision);
    for (std::size_t i = 0; i < rest_.size() && out_.defect.empty(); ++i) {
      const double off = norm(rest_[i] - shift - place(nodes[i]));
      // Both were rounded, and so was the spacing.
      if (off <= 8 * u * (out_.extent + norm(place(nodes[i])) + norm(shift))) continue;
      in_.refuse("rest", fmt::format("Particle {} rests {} m from its node.", i, off),
                 "Leave rest out, or give edges instead of nodes.");
    }
    if (rest_.empty()) {
      for (const Node& node : nodes) {
        rest_.push_back(place(node));
        out_.extent = std::max(out_.extent, norm(rest_.back()));
      }
    }
    origin_ = shift + Vec3{h * (least[0] - 1.0), h * (least[1] - 1.0), h * (least[2] - 1.0)};
  }

  void read_clusters() {
    Clusters& clusters = out_.state.clusters;
    const Array& offsets = in_.require("cluster_offsets", {-1});
    if (offsets.count() == 0) in_.refuse("cluster_offsets", "This is empty.", "It has one entry more than clusters.");
    clusters.offsets = in_.long_integers(offsets);
    clusters.members = in_.integers(in_.require("cluster_members", {-1}));
    const int64_t m = offsets.count() - 1;
    const auto count = static_cast<int64_t>(clusters.members.size());
    bool readable = clusters.offsets.front() == 0 && clusters.offsets.back() == count;
    readable = readable && std::is_sorted(clusters.offsets.begin(), clusters.offsets.end());
    for (int64_t c = 0; readable && c < m; ++c) {
      const auto first = clusters.members.begin() + clusters.offsets[at(c)];
      std::sort(first, clusters.members.begin() + clusters.offsets[at(c + 1)]);
    }
    clusters.number.resize(at(m));
    std::iota(clusters.number.begin(), clusters.number.end(), 0);
    if (const Array* const numbers = in_.find("numbers", {m})) clusters.number = in_.integers(*numbers);
    clusters.rotation.assign(at(m), Mat3{});
    if (in_.has("rotations")) {
      const Array& rotations = in_.require_either("rotations", {m, 3, 3}, {m, 9});
      const std::vector<Vec3> rows = vectors(rotations);
      for (std::size_t k = 0; k < rows.size(); ++k) {
        for (int column = 0; column < 3; ++column) {
          clusters.rotation[k / 3](static_cast<int>(k % 3), column) = rows[k][column];
        }
      }
    }
    clusters.degenerate.assign(at(m), 0);
    const Array* const centers = in_.find("rest_centers", {m, 3});
    const Array* const masses = in_.find("cluster_masses", {m});
    if (centers != nullptr) clusters.rest_center = places(*centers);
    if (masses != nullptr) {
      see_precision(*masses);
      clusters.mass = in_.numbers(*masses);
    }
    if (readable) {
      const std::vector<int32_t> held = times_held();
      for (int32_t i = 0; i < n() && out_.plain_weights; ++i) out_.setup.body.mass[at(i)] *= std::max(held[at(i)], 1);
      fill_rest_frames(held);
    }
    clusters.rest_center.resize(at(m));
    clusters.mass.resize(at(m), 1.0);
    if (readable) sort_by_number();
  }

  bool exists(int32_t i) const { return i >= 0 && i < n(); }

  // [n] In how many clusters each particle is.
  std::vector<int32_t> times_held() const {
    std::vector<int32_t> held(at(n()), 0);
    for (const int32_t i : out_.state.clusters.members) {
      if (exists(i)) ++held[at(i)];
    }
    return held;
  }

  // Missing parts of rest frames follow from the members, and are not judged.
  void fill_rest_frames(const std::vector<int32_t>& held) {
    Clusters& clusters = out_.state.clusters;
    const bool with_centers = clusters.rest_center.empty(), with_masses = clusters.mass.empty();
    if (!with_centers && !with_masses) return;
    const std::vector<Vec3>& rest = rest_.empty() ? out_.state.x : rest_;
    for (int32_t c = 0; c < clusters.count(); ++c) {
      double mass = 0;
      Vec3 sum;
      for (const int32_t i : clusters.of(c)) {
        if (!exists(i)) continue;
        const double w = out_.setup.body.mass[at(i)] / held[at(i)];
        mass += w;
        sum += w * rest[at(i)];
      }
      if (with_masses) clusters.mass.push_back(mass);
      if (with_centers) clusters.rest_center.push_back(mass > 0 ? sum / mass : Vec3{});
    }
  }

  void sort_by_number() {
    Clusters& clusters = out_.state.clusters;
    if (std::is_sorted(clusters.number.begin(), clusters.number.end())) return;
    std::vector<int32_t> order(clusters.number.size());
    std::iota(order.begin(), order.end(), 0);
    std::stable_sort(order.begin(), order.end(),
                     [&](int32_t a, int32_t b) { return clusters.number[at(a)] < clusters.number[at(b)]; });
    Clusters sorted;
    for (const int32_t c : order) {
      const auto members = clusters.of(c);
      sorted.members.insert(sorted.members.end(), members.begin(), members.end());
      sorted.offsets.push_back(static_cast<int64_t>(sorted.members.size()));
      sorted.number.push_back(clusters.number[at(c)]);
      sorted.rotation.push_back(clusters.rotation[at(c)]);
      sorted.rest_center.push_back(clusters.rest_center[at(c)]);
      sorted.mass.push_back(clusters.mass[at(c)]);
      sorted.degenerate.push_back(0);
    }
    clusters = std::move(sorted);
  }

  void read_skin() {
    if (!in_.both("vertices", "triangles")) {
      for (const char* const name : {"vertex_owner", "vertex_direction"}) {
        if (in_.has(name)) in_.refuse(name, "There are no vertices.", "Give vertices and triangles too.");
      }
      return;
    }
    Skin skin;
    skin.position = places(in_.require("vertices", {-1, 3}));
    const std::vector<int32_t> corners = in_.integers(in_.require("triangles", {-1, 3}));
    for (std::size_t k = 0; k + 2 < corners.size(); k += 3) {
      skin.triangles.push_back({corners[k], corners[k + 1], corners[k + 2]});
    }
    if (!in_.both("vertex_owner", "vertex_direction")) {
      out_.loose_skin = std::move(skin);
      return;
    }
    if (!in_.has("nodes") || !why_no_grid_.empty()) {
      in_.refuse("vertex_owner",
                 in_.has("nodes") ? why_no_grid_ : "Only a body on a grid has skin vertices with owners.",
                 in_.has("nodes") ? "Put the particles into the order of numpy.lexsort(nodes.T), near each other."
                                  : "Give nodes and spacing instead of edges, or leave vertex_owner and "
                                    "vertex_direction out.");
    }
    const auto v = static_cast<int64_t>(skin.position.size());
    skin.owner = in_.integers(in_.require("vertex_owner", {v}));
    for (const int32_t d : in_.integers(in_.require("vertex_direction", {v}))) {
      skin.direction.push_back(d >= 0 && d < 6 ? static_cast<uint8_t>(d) : uint8_t{255});  // found by "well formed"
    }
    out_.state.skin = std::move(skin);
    out_.state.skin.reach = uncut_reaches(out_.setup, out_.state.skin);
    out_.setup.skin.wanted = true;
    out_.state.frame = 1;  // a skin is due at the end of a frame, and this is one
  }

  // A body on a grid rests where its grid says, which need not be where the file has it.
  void move_into_body_frame() {
    State& state = out_.state;
    const double u = unit_roundoff(state.precision), in_double = unit_roundoff(Precision::binary64);
    state.place_rounding = u * out_.extent;
    if (!out_.setup.body.on_grid()) return;
    out_.setup.body.origin = origin_;
    for (std::vector<Vec3>* const places :
         {&state.x, &state.clusters.rest_center, &state.skin.position, &out_.loose_skin.position}) {
      for (Vec3& x : *places) x = x - origin_;
    }
    state.place_rounding += 2 * in_double * (out_.extent + norm(origin_));
  }

  NamedArrays in_;
  ForeignState out_;
  std::vector<Vec3> rest_;  // as given, or as the nodes say; empty: neither
  std::vector<std::pair<int32_t, int32_t>> edges_;
  std::string why_no_grid_;           // a grid was given, and its body has none
  std::vector<std::string> widened_;  // arrays of float64 that hold single precision
  Vec3 origin_;                       // of the body's frame, in the file's [m]
};

}  // namespace

const std::vector<KnownArray>& foreign_state_arrays() {
  static const std::vector<KnownArray> known = {
      {"positions", "positions of particles [m]"},
      {"alive", "1: in the tissue, 0: gone"},
      {"cluster_offsets", "where the members of each cluster begin, and the end of the last"},
      {"cluster_members", "particles, cluster by cluster"},
      {"edges", "pairs of particles that are joined"},
      {"edge_offsets", "where each particle's edges begin"},
      {"edge_ends", "other ends of edges"},
      {"nodes", "integer coordinates of particles on a regular grid"},
      {"spacing", "h: distance of neighbouring nodes, or length of an edge [m]"},
      {"rest", "rest positions of particles [m]"},
      {"mass", "masses of particles [kg]"},
      {"removed", "all particles removed by cuts"},
      {"velocities", "velocities of particles [m/s]"},
      {"rotations", "rotations of clusters, row by row"},
      {"rest_centers", "weighted means of rest positions [m]"},
      {"cluster_masses", "sums of weights [kg]"},
      {"numbers", "numbers of clusters, used in verdicts"},
      {"vertices", "vertices of the skin [m]"},
      {"triangles", "triangles of the skin, counter-clockwise from outside"},
      {"vertex_owner", "particle on whose grid edge a vertex lies"},
      {"vertex_direction", "direction of that edge: 0 to 5 for +x, -x, +y, -y, +z, -z"},
      {"alpha", "place of a vertex along its edge"},
      {"tau", "a cluster of fewer particles is small"},
      {"cap", "greatest number of particles of a merged cluster"},
      {"pieces", "number of pieces of tissue"},
  };
  return known;
}

const std::vector<KnownArray>& foreign_state_texts() {
  static const std::vector<KnownArray> known = {
      {"promises", "promises to judge, by name"},
      {"weights", "weights of particles in clusters: 'shared' or 'plain'"},
  };
  return known;
}

ForeignState foreign_state_of(const io::ArrayFile& contents, const std::string& file) {
  return Reader(contents, file).read();
}

}  // namespace cutproof::harness
