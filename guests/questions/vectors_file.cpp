// The layout of files of test vectors and of answers (docs/reference/vectors.md): arrays of all cases, one behind the
// other.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <set>
#include <utility>

#include "fixtures/rotation_answers.h"
#include "guests/questions/dissected.h"
#include "guests/questions/vectors.h"
#include "harness/named_arrays.h"
#include "model/at.h"
#include "model/error.h"
#include "oracles/best_rotation.h"
#include "reference_cpu/reference.h"

namespace cutproof::guests {

namespace {

using harness::KnownArray;
using harness::NamedArrays;

constexpr const char* kSchema = "cutproof.vectors";
constexpr const char* kVersion = "1";
constexpr const char* kAgain = "Make the file again with `cutproof vectors`.";

bool of_matrices(const OperationDescription& operation) { return operation.number == wire::rotations; }
bool has_clusters(const OperationDescription& operation) { return operation.number == wire::run; }
// Numbers that a case has one of, besides the spacing.
std::vector<std::string> limits_of(const OperationDescription& operation) {
  if (&operation == find_vector_operation("split")) return {"debris"};
  if (&operation == find_vector_operation("merge")) return {"tau", "cap"};
  return {};
}

// A name as texts of NPZ can hold it.
std::string in_ascii(const std::string& text) {
  constexpr std::pair<std::string_view, std::string_view> kWords[] = {
      {"±", "+-"}, {"°", " degrees"}, {"σ", "sigma"}, {"≈", "~"}, {"∞", "inf"}, {"≤", "<="}, {"ᵀ", "^T"}};
  std::string ascii;
  for (std::size_t k = 0; k < text.size();) {
    const auto word = std::find_if(std::begin(kWords), std::end(kWords), [&](const auto& w) {
      return std::string_view(text).substr(k).starts_with(w.first);
    });
    const bool known = word != std::end(kWords);
    ascii += known ? std::string(word->second) : std::string(1, text[k] > 0 ? text[k] : '?');
    k += known ? word->first.size() : 1;
  }
  return ascii;
}

// --- Growing arrays --------------------------------------------------------------------------------------------------

// An array to which the rows of each case are appended.
template <class T>
struct Column {
  std::string name;
  std::vector<int64_t> columns = {};  // extents of a row
  std::vector<T> values = {};
  int64_t rows() const {
    int64_t each = 1;
    for (const int64_t extent : columns) each *= extent;
    return static_cast<int64_t>(values.size()) / each;
  }
  Array take() const {
    std::vector<int64_t> shape = {rows()};
    shape.insert(shape.end(), columns.begin(), columns.end());
    return make_array(name, shape, values);
  }
};

// Numbers that users get in the precision of the vectors.
Array real_array(const Column<double>& column, Precision precision) {
  if (precision == Precision::binary64) return column.take();
  return Column<float>{column.name, column.columns, {column.values.begin(), column.values.end()}}.take();
}

template <class T>
void append(Column<T>& column, const Array& array) {
  for (int64_t k = 0; k < array.count(); ++k) {
    if constexpr (std::is_floating_point_v<T>) {
      column.values.push_back(static_cast<T>(array.number(k)));
    } else {
      column.values.push_back(static_cast<T>(array.integer(k)));
    }
  }
}

const Array& of(const Arrays& arrays, std::string_view name) { return *find_array(arrays, name); }

// --- Questions -------------------------------------------------------------------------------------------------------

void add_matrices(const Vectors& vectors, io::ArrayFile& file) {
  Column<double> a{"a", {9}}, previous{"previous", {9}};
  Column<uint8_t> expected{"expected"};
  Column<int64_t> offsets{"case_offsets", {}, {0}};
  for (const Question& question : vectors.cases) {
    append(a, of(question.given, "a"));
    append(previous, of(question.given, "previous"));
    append(expected, of(question.known, "expected"));
    offsets.values.push_back(a.rows());
  }
  file.arrays.push_back(offsets.take());
  file.arrays.push_back(real_array(a, vectors.precision));
  file.arrays.push_back(real_array(previous, vectors.precision));
  file.arrays.push_back(expected.take());
}

void add_bodies(const Vectors& vectors, io::ArrayFile& file) {
  Column<double> rest{"rest", {3}}, mass{"mass"}, spacing{"spacing"};
  Column<uint8_t> alive{"alive"};
  Column<int32_t> node{"node", {3}}, nodes{"nodes", {3}}, edges{"edges", {2}};
  Column<int64_t> offsets{"case_offsets", {}, {0}}, edge_offsets{"edge_offsets", {}, {0}};
  for (const Question& question : vectors.cases) {
    const Tissue tissue = tissue_of(question.given);
    const Body& body = tissue.body;
    append(rest, of(question.given, "rest"));
    append(mass, of(question.given, "mass"));
    append(alive, of(question.given, "alive"));
    append(spacing, of(question.given, "spacing"));
    for (int32_t i = 0; i < body.particle_count(); ++i) {
      std::array<int32_t, 3> at_node = {-1, -1, -1};
      if (body.on_grid()) at_node = body.grid.coordinates(body.node[at(i)]);
      node.values.insert(node.values.end(), at_node.begin(), at_node.end());
      std::set<int32_t> ends;
      for (const int32_t other : body.neighbours(i)) ends.insert(other);
      for (auto other = ends.upper_bound(i); other != ends.end(); ++other) {
        edges.values.insert(edges.values.end(), {i, *other});
      }
    }
    for (const int32_t extent : body.on_grid() ? body.grid.nodes : std::array<int32_t, 3>{0, 0, 0}) {
      nodes.values.push_back(extent);
    }
    offsets.values.push_back(alive.rows());
    edge_offsets.values.push_back(edges.rows());
  }
  for (Array& array :
       Arrays{offsets.take(), alive.take(), edge_offsets.take(), edges.take(), real_array(rest, vectors.precision),
              real_array(mass, vectors.precision), node.take(), nodes.take(), spacing.take()}) {
    file.arrays.push_back(std::move(array));
  }
}

// Appends each case's `offsets`, `members` and arrays with an entry for each cluster.
void add_clusters(const std::vector<Arrays>& cases, const std::vector<std::string>& of_cluster,
                  const std::string& prefix, io::ArrayFile& file) {
  Column<int64_t> cluster_offsets{prefix + "cluster_offsets", {}, {0}}, offsets{prefix + "offsets", {}, {0}};
  Column<int32_t> members{prefix + "members"};
  std::vector<Column<int32_t>> others;
  for (const std::string& name : of_cluster) others.push_back({prefix + name});
  for (const Arrays& each : cases) {
    const int64_t before = members.rows();
    const Array& ends = of(each, "offsets");
    for (int64_t k = 1; k < ends.rows(); ++k) offsets.values.push_back(before + ends.integer(k));
    append(members, of(each, "members"));
    for (std::size_t k = 0; k < others.size(); ++k) append(others[k], of(each, of_cluster[k]));
    cluster_offsets.values.push_back(offsets.rows() - 1);
  }
  for (Array& array : Arrays{cluster_offsets.take(), offsets.take(), members.take()}) {
    file.arrays.push_back(std::move(array));
  }
  for (const Column<int32_t>& other : others) file.arrays.push_back(other.take());
}

// --- What is known of the answers ------------------------------------------------------------------------------------

// The smallest particle of each one's component; -1: dead.
Array components_of(const Tissue& tissue, std::string name) {
  Column<int32_t> label{std::move(name), {}, std::vector<int32_t>(tissue.alive.size(), -1)};
  std::vector<int32_t> queue;
  for (int32_t first = 0; first < tissue.body.particle_count(); ++first) {
    if (tissue.alive[at(first)] == 0 || label.values[at(first)] >= 0) continue;
    queue = {first};
    label.values[at(first)] = first;
    for (std::size_t k = 0; k < queue.size(); ++k) {
      for (const int32_t other : tissue.body.neighbours(queue[k])) {
        if (tissue.alive[at(other)] == 0 || label.values[at(other)] >= 0) continue;
        label.values[at(other)] = first;
        queue.push_back(other);
      }
    }
  }
  return label.take();
}

void add_components(const Vectors& vectors, const std::string& name, io::ArrayFile& file) {
  Column<int32_t> label{name};
  for (const Question& question : vectors.cases) append(label, components_of(tissue_of(question.given), name));
  file.arrays.push_back(label.take());
}

Mat3 matrix(const Array& array, int64_t row) {
  Mat3 m;
  for (std::size_t k = 0; k < 9; ++k) m.m[k] = array.number(9 * row + static_cast<int64_t>(k));
  return m;
}

// The best value, and the answer where it is determined: beyond rounding, the best rotation is no more than
// sqrt(bound / separation) away from any that is accepted.
void add_rotations(const Vectors& vectors, io::ArrayFile& file) {
  const fixtures::RotationBounds bounds = fixtures::rotation_bounds(vectors.precision);
  Column<double> greatest{"must_greatest"}, sum{"must_singular_sum"}, separation{"must_separation"}, r{"answer_r", {9}};
  Column<int32_t> exponent{"must_exponent"};
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  Mat3 any;
  any.m.fill(kNan);
  for (const Question& question : vectors.cases) {
    const Array &a = of(question.given, "a"), &previous = of(question.given, "previous");
    const auto expected = of(question.known, "expected").of<uint8_t>();
    for (int64_t row = 0; row < a.rows(); ++row) {
      const Mat3 from = matrix(a, row), before = matrix(previous, row);
      Mat3 answer = before;
      if (expected[at(row)] == 2) {
        for (Column<double>* const column : {&greatest, &sum, &separation}) column->values.push_back(kNan);
        exponent.values.push_back(0);
      } else {
        const oracles::BestRotation best = oracles::best_rotation(from);
        double most = 0;
        for (const double entry : from.m) most = std::max(most, std::abs(entry));
        int power = 0;
        std::frexp(most, &power);
        greatest.values.push_back(static_cast<double>(best.value));
        sum.values.push_back(static_cast<double>(best.sum));
        separation.values.push_back(best.separation);
        exponent.values.push_back(power);
        if (expected[at(row)] == 1) {
          const oracles::NearestRotation nearest = oracles::nearest_of_rank_one(best, before);
          answer = nearest.weight > bounds.deviation ? nearest.r : any;
        } else {
          answer = best.separation > bounds.gap + best.error ? reference::closest_rotation(from, before).r : any;
        }
      }
      r.values.insert(r.values.end(), answer.m.begin(), answer.m.end());
    }
  }
  for (Array& array : Arrays{greatest.take(), sum.take(), exponent.take(), separation.take(),
                             make_array("bound_orthogonality", {1}, std::vector<double>{bounds.orthogonality}),
                             make_array("bound_gap", {1}, std::vector<double>{bounds.gap}),
                             make_array("bound_deviation", {1}, std::vector<double>{bounds.deviation}), r.take()}) {
    file.arrays.push_back(std::move(array));
  }
}

void add_surface(const Vectors& vectors, io::ArrayFile& file) {
  Column<int64_t> outer{"must_outer_shells"}, inner{"must_inner_shells"}, offsets{"must_vertex_offsets", {}, {0}};
  Column<int32_t> crossed{"must_vertex_edges", {4}};
  for (const Question& question : vectors.cases) {
    const Tissue tissue = tissue_of(question.given);
    const auto [out, in] = shells_around(tissue);
    outer.values.push_back(out);
    inner.values.push_back(in);
    for (int32_t i = 0; i < tissue.body.particle_count(); ++i) {
      if (tissue.alive[at(i)] == 0) continue;
      for (int direction = 0; direction < 6; ++direction) {
        const int32_t other = tissue.body.neighbour(i, direction);
        if (other >= 0 && tissue.alive[at(other)] != 0) continue;
        const auto node = tissue.body.grid.coordinates(tissue.body.node[at(i)]);
        crossed.values.insert(crossed.values.end(), {node[0], node[1], node[2], direction});
      }
    }
    offsets.values.push_back(crossed.rows());
  }
  for (Array& array :
       Arrays{outer.take(), inner.take(), offsets.take(), crossed.take(),
              make_array("bound_place", {1}, std::vector<double>{8 * unit_roundoff(vectors.precision)})}) {
    file.arrays.push_back(std::move(array));
  }
}

// The reference's answer to the clusters.
void add_stage(const Vectors& vectors, io::ArrayFile& file) {
  const bool splits = limits_of(*vectors.operation).size() == 1;
  std::vector<Arrays> answers;
  Column<uint8_t> alive{"answer_alive"};
  for (const Question& question : vectors.cases) {
    auto [setup, state] = before_stage(question, true);
    (splits ? reference::split : reference::merge)(setup, state);
    Arrays& answer = answers.emplace_back(clusters_of(state));
    Column<int32_t> origin{"origin"};
    for (const Mat3& rotation : state.clusters.rotation) origin.values.push_back(static_cast<int32_t>(rotation.m[0]));
    answer.push_back(origin.take());
    alive.values.insert(alive.values.end(), state.alive.begin(), state.alive.end());
  }
  if (splits) {
    add_clusters(answers, {"number", "origin"}, "answer_", file);
    file.arrays.push_back(alive.take());
  } else {
    add_clusters(answers, {"number"}, "example_", file);
  }
}

// A paragraph for each property that is judged.
std::string acceptable_text(const Vectors& vectors) {
  const std::string_view name = vectors.operation->name;
  if (name == "rotations") {
    const fixtures::RotationBounds bounds = fixtures::rotation_bounds(vectors.precision);
    return fmt::format(
        "rotation: every answer is finite, |R^T R - I| (Frobenius) is at most bound_orthogonality = {:.4g}, and det R "
        "> 0. Asked where expected is 0 or 1, and where A is zero.\nbest rotation: where expected is 0 or 1. Divide A "
        "by 2^must_exponent; then (must_greatest - tr(R^T A)) / must_singular_sum is at most bound_gap = {:.4g}. The "
        "answer is unique where must_separation is not 0: (sigma2 + s sigma3) / sigma1 with s the sign of det A. There "
        "answer_r has this answer, and NaN elsewhere.\nnearest rotation: where expected is 1, A has rank one and many "
        "rotations are best. R is the one nearest to previous, within bound_deviation = {:.4g} times a weight, in the "
        "Frobenius norm. The weight lies in 0..1 and falls to 0 where all are equally near.\nprevious rotation kept: "
        "where expected is 2, the rotation is undetermined (A is zero or not finite). R is previous, to the bit.",
        bounds.orthogonality, bounds.gap, bounds.deviation);
  }
  if (name == "components") {
    return "components: two living particles of a case have the same label exactly where a path of edges between "
           "living particles joins them. Any labels will do. answer_label has the smallest particle of each component, "
           "and -1 for dead particles, whose labels are not judged. There is no tolerance.";
  }
  if (name == "surface") {
    return fmt::format(
        "surface vertices: exactly one vertex on each edge of the grid that leaves the tissue, strictly between its "
        "ends, and no other. must_vertex_edges has the living node (3 columns) and the direction of each such edge (0 "
        "to 5: +x, -x, +y, -y, +z, -z). Across the edge, a place may be off by bound_place = {:.4g} times its greatest "
        "coordinate in spacings, or times 1.\nsurface: closed, oriented and 2-manifold. Each directed edge of a "
        "triangle is there once, its reverse once; the triangles at a vertex form one fan; each vertex is used. "
        "Triangles are counter-clockwise seen from outside.\nsurface places: each vertex lies in a cell of the grid "
        "that has living and empty corners, or on its boundary.\nsurface shells: must_outer_shells closed parts of "
        "positive volume, one around each component; must_inner_shells of negative volume, one around each cavity. "
        "Nodes are joined by edges of the grid; empty ones also across the diagonals of faces.",
        8 * unit_roundoff(vectors.precision));
  }
  constexpr const char* kForm =
      "well formed: offsets do not descend, and members are particles of the case. {}\n"
      "cluster connectivity: the members of each cluster are connected by edges between living members of it.\n"
      "coverage: each living particle lies in a cluster, no dead one does; no cluster is empty; members ascend.\n";
  if (name == "clusters") {
    return fmt::format(kForm, "Numbers are not asked for.") +
           "component match: two particles have the same must_component exactly where a chain of clusters that share "
           "particles joins them.\n"
           "isolation: there are as many groups of clusters that share particles as there are components.\n"
           "edge cover: both ends of each edge lie in one cluster. Judged if edges_covered is promised.\n"
           "There is no tolerance.";
  }
  const std::string form = fmt::format(kForm, "Numbers are not negative and ascend.");
  if (name == "split") {
    return form +
           "split exactness: the answer is unique. First, components of fewer than debris living particles are "
           "removed, which alive shows. A cluster without a lost particle is unchanged. Each other cluster is replaced "
           "by the connected components of its rest. The component with the smallest particle keeps the number. The "
           "others get new numbers, from the greatest number plus 1, ordered by the old cluster and by their smallest "
           "particles. origin, if given, is the number of the cluster that each component comes from. The answer is in "
           "answer_alive, answer_offsets, answer_members, answer_number and answer_origin. There is no tolerance.";
  }
  return form +
         "merge legality: each cluster of the answer is one of the question, or a union of several touching ones under "
         "the number of one of them. Clusters touch if they share a particle or if an edge between living particles "
         "joins them. No cluster is used twice or lost. Only clusters of fewer than tau particles are merged "
         "away.\ncap kept: no union has more than cap particles, unless all of them lay in one cluster before.\nmerge "
         "maximality: no cluster of fewer than tau particles lies within another, or touches one with which it would "
         "have at most cap particles.\nThere is no tolerance, and many answers are right. example_offsets, "
         "example_members and example_number have one right answer.";
}

// Texts as they stand in a file.
std::string kinds_text(const std::vector<std::string>& kinds) {
  std::string text;
  for (const std::string& kind : kinds) text += (text.empty() ? "" : "\n") + in_ascii(kind);
  return text;
}

const char* name_of(Precision precision) { return precision == Precision::binary32 ? "single" : "double"; }

// --- Reading ---------------------------------------------------------------------------------------------------------

// Arrays of which rows belong to cases.
class Reader {
 public:
  Reader(const NamedArrays& arrays, const std::vector<std::string>* kinds, const std::vector<int32_t>* kind)
      : arrays_(arrays), kinds_(kinds), kind_(kind) {}

  // One entry more than cases; from 0 to `end`. Case k ends where the next one begins.
  std::vector<int64_t> offsets(const std::string& name, int64_t cases, int64_t end, const char* what) const {
    const std::vector<int64_t> values = arrays_.long_integers(arrays_.require(name, {-1}));
    const auto there = static_cast<int64_t>(values.size()) - 1;
    if (there < cases) {
      arrays_.refuse(
          name,
          fmt::format("It has {} entries for {} cases: the first without an answer is {}.", there + 1, cases,
                      case_named(std::max<int64_t>(there, 0))),
          fmt::format("Answer every case: write {} entries, the last one the number of {}.", cases + 1, what));
    }
    if (there > cases) {
      arrays_.refuse(name, fmt::format("It has {} entries for {} cases.", there + 1, cases),
                     fmt::format("Write {} entries, the last one the number of {}.", cases + 1, what));
    }
    if (values.front() != 0) arrays_.refuse(name, fmt::format("It begins with {}.", values.front()), "Begin with 0.");
    for (int64_t k = 0; k < cases; ++k) {
      if (values[at(k)] <= values[at(k + 1)]) continue;
      arrays_.refuse(name, fmt::format("It descends after {}.", case_named(k)), "Write where each case begins.");
    }
    if (values.back() != end) {
      arrays_.refuse(name, fmt::format("It ends with {}, and there are {} {}.", values.back(), end, what),
                     fmt::format("End with the number of {}.", what));
    }
    return values;
  }
  // Of an array that has a row for each thing of all cases.
  const Array& rows(const std::string& name, const std::vector<int64_t>& columns,
                    const std::vector<int64_t>& case_offsets) const {
    std::vector<int64_t> shape = {-1};
    shape.insert(shape.end(), columns.begin(), columns.end());
    const Array& array = arrays_.require(name, shape);
    if (array.rows() < case_offsets.back()) {
      const auto next = std::upper_bound(case_offsets.begin(), case_offsets.end(), array.rows());
      arrays_.refuse(name,
                     fmt::format("It has {} rows for {}: they end in {}.", array.rows(), case_offsets.back(),
                                 case_named(next - case_offsets.begin() - 1)),
                     "Answer every case, in their order.");
    }
    if (array.rows() > case_offsets.back()) {
      arrays_.refuse(name, fmt::format("It has {} rows for {}.", array.rows(), case_offsets.back()),
                     "Give one row for each that the question has.");
    }
    return array;
  }
  std::string case_named(int64_t index) const {
    if (kind_ == nullptr || index >= static_cast<int64_t>(kind_->size())) return fmt::format("case {}", index);
    return fmt::format("case {} ({})", index, (*kinds_)[at((*kind_)[at(index)])]);
  }
  const NamedArrays& arrays() const { return arrays_; }

 private:
  const NamedArrays& arrays_;
  const std::vector<std::string>* kinds_;
  const std::vector<int32_t>* kind_;
};

template <class T>
Array part(const std::string& name, const std::vector<T>& values, const std::vector<int64_t>& offsets, std::size_t k,
           const std::vector<int64_t>& columns = {}) {
  int64_t each = 1;
  std::vector<int64_t> shape = {offsets[k + 1] - offsets[k]};
  for (const int64_t extent : columns) {
    each *= extent;
    shape.push_back(extent);
  }
  return make_array(name, shape,
                    std::vector<T>(values.begin() + offsets[k] * each, values.begin() + offsets[k + 1] * each));
}

std::vector<uint8_t> bytes_of(const NamedArrays& arrays, const Array& array) {
  std::vector<uint8_t> values;
  for (const int32_t value : arrays.integers(array)) {
    if (value < 0 || value > 255) {
      arrays.refuse(array.name, fmt::format("Entry {} is {}.", values.size(), value), "Write 0 or 1.");
    }
    values.push_back(static_cast<uint8_t>(value));
  }
  return values;
}

// `offsets`, `members` and others of each case, as the judges take them. The judges check values within a case.
class ClusterReader {
 public:
  ClusterReader(const Reader& reader, int64_t cases, const std::vector<std::string>& of_cluster) {
    const NamedArrays& arrays = reader.arrays();
    offsets_ = arrays.long_integers(arrays.require("offsets", {-1}));
    members_ = arrays.integers(arrays.require("members", {-1}));
    if (offsets_.empty()) arrays.refuse("offsets", "It is empty.", "Begin with 0, also where there is no cluster.");
    const auto last = static_cast<int64_t>(members_.size());
    for (std::size_t k = 0; k < offsets_.size(); ++k) {
      if (offsets_[k] >= 0 && offsets_[k] <= last) continue;
      arrays.refuse("offsets", fmt::format("Entry {} is {}, and there are {} members.", k, offsets_[k], last),
                    "Count members through all cases, from 0.");
    }
    const auto count = static_cast<int64_t>(offsets_.size()) - 1;
    cluster_offsets_ = reader.offsets("cluster_offsets", cases, count, "clusters");
    for (const std::string& name : of_cluster) {
      if (!arrays.has(name)) continue;
      others_.emplace_back(name, arrays.integers(reader.rows(name, {}, cluster_offsets_)));
    }
    // Where the members of each case begin.
    for (const int64_t first : cluster_offsets_) member_offsets_.push_back(offsets_[at(first)]);
    if (member_offsets_.front() != 0) {
      arrays.refuse("offsets", fmt::format("It begins with {}.", member_offsets_.front()), "Begin with 0.");
    }
    for (int64_t k = 0; k < cases; ++k) {
      if (member_offsets_[at(k)] <= member_offsets_[at(k + 1)]) continue;
      arrays.refuse("offsets", fmt::format("It descends in {}.", reader.case_named(k)),
                    "Count members through all cases.");
    }
    if (member_offsets_.back() != last) {
      arrays.refuse("offsets", fmt::format("It ends with {}, and there are {} members.", member_offsets_.back(), last),
                    "Count members through all cases, and end with their number.");
    }
  }
  Array offsets_of(std::size_t k) const {
    std::vector<int64_t> local;
    for (int64_t c = cluster_offsets_[k]; c <= cluster_offsets_[k + 1]; ++c) {
      local.push_back(offsets_[at(c)] - member_offsets_[k]);
    }
    return make_array("offsets", {static_cast<int64_t>(local.size())}, local);
  }
  Array members_of(std::size_t k) const { return part("members", members_, member_offsets_, k); }
  // Without a name if it was not given.
  Array other(const std::string& name, std::size_t k) const {
    for (const auto& [known, values] : others_) {
      if (known == name) return part(name, values, cluster_offsets_, k);
    }
    return make_array("", {0}, std::vector<int32_t>{});
  }

 private:
  std::vector<int64_t> offsets_, cluster_offsets_, member_offsets_;
  std::vector<int32_t> members_;
  std::vector<std::pair<std::string, std::vector<int32_t>>> others_;
};

void read_matrices(const Reader& reader, Vectors& vectors) {
  const NamedArrays& arrays = reader.arrays();
  const auto cases = static_cast<int64_t>(vectors.kind.size());
  const Array& a = arrays.require("a", {-1, 9});
  const std::vector<int64_t> offsets = reader.offsets("case_offsets", cases, a.rows(), "matrices");
  const std::vector<double> matrices = arrays.numbers(a),
                            previous = arrays.numbers(reader.rows("previous", {9}, offsets));
  const std::vector<uint8_t> expected = bytes_of(arrays, reader.rows("expected", {}, offsets));
  for (std::size_t k = 0; k < vectors.kind.size(); ++k) {
    vectors.cases.push_back({vectors.kinds[at(vectors.kind[k])],
                             {part("a", matrices, offsets, k, {9}), part("previous", previous, offsets, k, {9})},
                             {part("expected", expected, offsets, k)}});
  }
}

void read_bodies(const Reader& reader, Vectors& vectors) {
  const NamedArrays& arrays = reader.arrays();
  const auto cases = static_cast<int64_t>(vectors.kind.size());
  const Array& living = arrays.require("alive", {-1});
  const std::vector<int64_t> offsets = reader.offsets("case_offsets", cases, living.rows(), "particles");
  const std::vector<uint8_t> alive = bytes_of(arrays, living);
  const std::vector<double> rest = arrays.numbers(reader.rows("rest", {3}, offsets)),
                            mass = arrays.numbers(reader.rows("mass", {}, offsets)),
                            spacing = arrays.numbers(arrays.require("spacing", {cases}));
  const std::vector<int32_t> node = arrays.integers(reader.rows("node", {3}, offsets)),
                             nodes = arrays.integers(arrays.require("nodes", {cases, 3}));
  const Array& pairs = arrays.require("edges", {-1, 2});
  const std::vector<int64_t> edge_offsets = reader.offsets("edge_offsets", cases, pairs.rows(), "edges");
  const std::vector<int32_t> edges = arrays.integers(pairs);
  std::optional<ClusterReader> clusters;
  if (has_clusters(*vectors.operation)) clusters.emplace(reader, cases, std::vector<std::string>{"number"});
  for (std::size_t k = 0; k < vectors.kind.size(); ++k) {
    const int64_t n = offsets[k + 1] - offsets[k];
    std::vector<std::set<int32_t>> ends(at(n));
    for (int64_t e = edge_offsets[k]; e < edge_offsets[k + 1]; ++e) {
      const int32_t one = edges[at(2 * e)], other = edges[at(2 * e + 1)];
      if (one < 0 || other < 0 || one >= n || other >= n) {
        arrays.refuse("edges",
                      fmt::format("Row {} joins particles {} and {}, and {} has {}.", e, one, other,
                                  reader.case_named(static_cast<int64_t>(k)), n),
                      kAgain);
      }
      ends[at(one)].insert(other);
      ends[at(other)].insert(one);
    }
    std::vector<int64_t> begins = {0};
    std::vector<int32_t> others;
    for (const std::set<int32_t>& of_one : ends) {
      others.insert(others.end(), of_one.begin(), of_one.end());
      begins.push_back(static_cast<int64_t>(others.size()));
    }
    Question question;
    question.kind = vectors.kinds[at(vectors.kind[k])];
    question.given = {make_array("edge_offsets", {n + 1}, begins), make_array("edge_ends", {begins.back()}, others),
                      part("rest", rest, offsets, k, {3}), part("mass", mass, offsets, k)};
    if (nodes[3 * k] != 0) {
      question.given.push_back(part("node", node, offsets, k, {3}));
      question.given.push_back(
          make_array("nodes", {3},
                     std::vector<int32_t>(nodes.begin() + static_cast<std::ptrdiff_t>(3 * k),
                                          nodes.begin() + static_cast<std::ptrdiff_t>(3 * k + 3))));
    }
    question.given.push_back(make_array("spacing", {1}, std::vector<double>{spacing[k]}));
    question.given.push_back(part("alive", alive, offsets, k));
    if (clusters) {
      question.given.push_back(clusters->offsets_of(k));
      question.given.push_back(clusters->members_of(k));
      question.given.push_back(clusters->other("number", k));
    }
    for (const std::string& name : limits_of(*vectors.operation)) {
      const int32_t limit = arrays.integers(arrays.require(name, {cases}))[k];
      question.given.push_back(make_array(name, {1}, std::vector<int32_t>{limit}));
    }
    vectors.cases.push_back(std::move(question));
  }
}

// Whatever was read is what was written: answers and edges follow from the questions. Of real numbers that were
// computed the last bits are another machine's.
void require_same(const io::ArrayFile& contents, const Vectors& vectors, const NamedArrays& arrays) {
  const io::ArrayFile again = file_of(vectors);
  for (const Array& wanted : again.arrays) {
    const Array& read = *find_array(contents.arrays, wanted.name);
    const bool computed =
        (wanted.name.starts_with("must_") || wanted.name.starts_with("answer_")) && harness::is_real(wanted);
    if (read.shape == wanted.shape && (computed || read.bytes == wanted.bytes)) continue;
    arrays.refuse(wanted.name, "It is not what follows from the other arrays.", kAgain);
  }
}

}  // namespace

io::ArrayFile file_of(const Vectors& vectors) {
  const OperationDescription& operation = *vectors.operation;
  io::ArrayFile file;
  file.texts = {{"schema", fmt::format("{} {} {}", kSchema, operation.name, kVersion)},
                {"precision", name_of(vectors.precision)},
                {"seed", std::to_string(vectors.seed)},
                {"kinds", kinds_text(vectors.kinds)},
                {"acceptable", acceptable_text(vectors)}};
  file.arrays.push_back(make_array("kind", {static_cast<int64_t>(vectors.kind.size())}, vectors.kind));
  if (of_matrices(operation)) {
    add_matrices(vectors, file);
    add_rotations(vectors, file);
    return file;
  }
  add_bodies(vectors, file);
  if (has_clusters(operation)) {
    std::vector<Arrays> clusters;
    for (const Question& question : vectors.cases) clusters.push_back(question.given);
    add_clusters(clusters, {"number"}, "", file);
    for (const std::string& name : limits_of(operation)) {
      Column<int32_t> limit{name};
      for (const Question& question : vectors.cases) append(limit, of(question.given, name));
      file.arrays.push_back(limit.take());
    }
    add_stage(vectors, file);
  }
  if (operation.number == wire::components) add_components(vectors, "answer_label", file);
  if (operation.number == wire::clusters) add_components(vectors, "must_component", file);
  if (operation.number == wire::surface) add_surface(vectors, file);
  return file;
}

Vectors vectors_of(const io::ArrayFile& contents, const std::string& file) {
  const auto refuse = [&](const char* name, const std::string& problem) -> InputError {
    return {file, name, problem, "Give a file that `cutproof vectors` has made."};
  };
  const std::string* const schema = io::find_text(contents, "schema");
  if (schema == nullptr) throw refuse("schema", "This text is not there: these are no test vectors.");
  Vectors vectors;
  for (const OperationDescription& each : vector_operations()) {
    if (*schema == fmt::format("{} {} {}", kSchema, each.name, kVersion)) vectors.operation = &each;
  }
  if (vectors.operation == nullptr) {
    throw refuse("schema", fmt::format("It says '{}', which this program does not read.", *schema));
  }
  // Arrays of a file without cases are in every file.
  const io::ArrayFile model = file_of(vectors);
  std::vector<KnownArray> known, known_texts;
  for (const Array& array : model.arrays) known.push_back({array.name, ""});
  for (const io::NamedText& text : model.texts) known_texts.push_back({text.name, ""});
  const NamedArrays arrays(contents, file, known, known_texts);
  for (const io::NamedText& text : model.texts) {
    if (io::find_text(contents, text.name) == nullptr) arrays.refuse(text.name, "This text is not there.", kAgain);
  }
  const std::string& precision = *io::find_text(contents, "precision");
  if (precision != "single" && precision != "double") {
    arrays.refuse("precision", fmt::format("It says '{}'.", precision), "Write single or double.");
  }
  vectors.precision = precision == "double" ? Precision::binary64 : Precision::binary32;
  const std::string& seed = *io::find_text(contents, "seed");
  try {
    std::size_t end = 0;
    vectors.seed = std::stoull(seed, &end);
    if (end != seed.size() || seed.front() == '-') throw std::invalid_argument(seed);
  } catch (const std::logic_error&) {
    arrays.refuse("seed", fmt::format("It says '{}'.", seed), kAgain);
  }
  const std::string& kinds = *io::find_text(contents, "kinds");
  for (std::size_t begin = 0; begin <= kinds.size();) {
    const std::size_t end = std::min(kinds.find('\n', begin), kinds.size());
    vectors.kinds.push_back(kinds.substr(begin, end - begin));
    begin = end + 1;
  }
  const io::ArrayFile typed = file_of(vectors);
  for (const Array& array : typed.arrays) {
    const Array* const found = find_array(contents.arrays, array.name);
    std::vector<int64_t> shape = array.shape;
    if (!array.name.starts_with("bound_")) shape[0] = -1;  // those are one number
    arrays.require(array.name, shape);
    if (found->type == array.type) continue;
    arrays.refuse(
        array.name,
        fmt::format("It holds {}, and should hold {}.", cutproof::name_of(found->type), cutproof::name_of(array.type)),
        kAgain);
  }
  vectors.kind = arrays.integers(arrays.require("kind", {-1}));
  for (const int32_t kind : vectors.kind) {
    if (kind >= 0 && kind < static_cast<int32_t>(vectors.kinds.size())) continue;
    arrays.refuse("kind", fmt::format("It has {}, and there are {} kinds.", kind, vectors.kinds.size()), kAgain);
  }
  if (static_cast<int64_t>(vectors.kind.size()) > kMostCases) {
    arrays.refuse("kind", fmt::format("There are {} cases, more than {}.", vectors.kind.size(), kMostCases), kAgain);
  }
  const Reader reader(arrays, &vectors.kinds, &vectors.kind);
  of_matrices(*vectors.operation) ? read_matrices(reader, vectors) : read_bodies(reader, vectors);
  for (std::size_t k = 0; k < vectors.cases.size(); ++k) {
    std::string problem = vectors.operation->problem(vectors.cases[k]);
    const Array* const node = find_array(vectors.cases[k].given, "node");
    const Body body = problem.empty() && node != nullptr ? tissue_of(vectors.cases[k].given).body : Body{};
    if (!std::is_sorted(body.node.begin(), body.node.end())) problem = "nodes do not ascend";
    if (problem.empty()) continue;
    throw InputError(file, reader.case_named(static_cast<int64_t>(k)), problem, kAgain);
  }
  require_same(contents, vectors, arrays);
  return vectors;
}

// --- Answers ---------------------------------------------------------------------------------------------------------

namespace {

bool is_of_clusters(std::string_view name) {
  return name == "offsets" || name == "members" || name == "number" || name == "origin";
}

// "vertices" -> "vertex_offsets"
std::string offsets_name(std::string_view name) { return name == "vertices" ? "vertex_offsets" : "triangle_offsets"; }

std::vector<KnownArray> known_answers(const OperationDescription& operation) {
  std::vector<KnownArray> known;
  for (const AnswerArray& answer : operation.answers) {
    known.push_back({answer.name, answer.text});
    if (answer.name == "offsets") known.push_back({"cluster_offsets", "where the clusters of each case begin"});
    if (answer.name == "vertices") known.push_back({"vertex_offsets", "where the vertices of each case begin"});
    if (answer.name == "triangles") known.push_back({"triangle_offsets", "where the triangles of each case begin"});
  }
  return known;
}

// Real answers must not be coarser than the requested precision.
void require_precision(const Array& array, const Vectors& vectors, const NamedArrays& arrays) {
  if (!harness::is_real(array)) {
    arrays.refuse(array.name,
                  fmt::format("It holds {}, and should hold float32 or float64.", cutproof::name_of(array.type)),
                  "Write floating-point numbers.");
  }
  if (array.type == ElementType::f64 || vectors.precision == Precision::binary32) return;
  arrays.refuse(array.name, "It holds float32, and these vectors are in double precision.",
                "Write float64, or answer vectors that were made with `--precision single`.");
}

}  // namespace

AllAnswers answers_of(const io::ArrayFile& contents, const std::string& file, const Vectors& vectors) {
  const OperationDescription& operation = *vectors.operation;
  const NamedArrays arrays(contents, file, known_answers(operation), {});
  const Reader reader(arrays, &vectors.kinds, &vectors.kind);
  const auto cases = static_cast<int64_t>(vectors.cases.size());
  std::vector<int64_t> case_offsets = {0};
  for (const Question& question : vectors.cases) {
    case_offsets.push_back(case_offsets.back() + of(question.given, of_matrices(operation) ? "a" : "alive").rows());
  }
  AllAnswers all(at(cases));
  std::optional<ClusterReader> clusters;
  for (const AnswerArray& wanted : operation.answers) {
    const std::string name(wanted.name);
    if (is_of_clusters(wanted.name)) {
      if (!clusters) {
        std::vector<std::string> of_cluster;
        for (const AnswerArray& each : operation.answers) {
          const bool is_list = each.name == "offsets" || each.name == "members";
          if (is_of_clusters(each.name) && !is_list) of_cluster.emplace_back(each.name);
        }
        clusters.emplace(reader, cases, of_cluster);
      }
      if (!wanted.optional) arrays.require(name, {-1});
      for (std::size_t k = 0; k < all.size(); ++k) {
        all[k].push_back(name == "offsets"   ? clusters->offsets_of(k)
                         : name == "members" ? clusters->members_of(k)
                                             : clusters->other(name, k));
      }
      continue;
    }
    std::vector<int64_t> columns, offsets = case_offsets;
    if (wanted.columns > 1) columns = {wanted.columns};
    const Array* const found = find_array(contents.arrays, name);
    if (wanted.columns == 9 && found != nullptr && found->shape.size() == 3) columns = {3, 3};
    if (wanted.rows_of.empty()) {
      std::vector<int64_t> shape = {-1};
      shape.insert(shape.end(), columns.begin(), columns.end());
      offsets = reader.offsets(offsets_name(name), cases, arrays.require(name, shape).rows(), wanted.name.data());
    }
    const Array& array = reader.rows(name, columns, offsets);
    if (wanted.real) {
      require_precision(array, vectors, arrays);
      const std::vector<double> values = arrays.numbers(array);
      for (std::size_t k = 0; k < all.size(); ++k) all[k].push_back(part(name, values, offsets, k, {wanted.columns}));
    } else if (wanted.type == ElementType::u8) {
      const std::vector<uint8_t> values = bytes_of(arrays, array);
      for (std::size_t k = 0; k < all.size(); ++k) all[k].push_back(part(name, values, offsets, k, columns));
    } else {
      const std::vector<int32_t> values = arrays.integers(array);
      for (std::size_t k = 0; k < all.size(); ++k) all[k].push_back(part(name, values, offsets, k, columns));
    }
  }
  return all;
}

io::ArrayFile file_of_answers(const Vectors& vectors, const AllAnswers& answers) {
  io::ArrayFile file;
  std::vector<std::string> of_cluster;
  bool clusters = false;
  const auto& wanted = vectors.operation->answers;
  for (std::size_t k = 0; k < wanted.size(); ++k) {
    const std::string name(wanted[k].name);
    if (is_of_clusters(name)) {
      clusters = true;
      const bool given = !answers.empty() && !answers.front()[k].name.empty();
      if (name != "offsets" && name != "members" && given) of_cluster.push_back(name);
      continue;
    }
    std::vector<int64_t> columns;
    if (wanted[k].columns > 1) columns = {wanted[k].columns};
    Column<int64_t> offsets{offsets_name(name), {}, {0}};
    Column<double> numbers{name, columns};
    Column<int32_t> integers{name, columns};
    for (const Arrays& each : answers) {
      wanted[k].real ? append(numbers, each[k]) : append(integers, each[k]);
      offsets.values.push_back(wanted[k].real ? numbers.rows() : integers.rows());
    }
    file.arrays.push_back(wanted[k].real ? real_array(numbers, vectors.precision) : integers.take());
    if (wanted[k].rows_of.empty()) file.arrays.push_back(offsets.take());
  }
  if (clusters) add_clusters(answers, of_cluster, "", file);
  return file;
}

}  // namespace cutproof::guests
