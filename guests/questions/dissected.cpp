#include "guests/questions/dissected.h"

#include <algorithm>
#include <limits>
#include <numeric>
#include <stdexcept>

#include "model/at.h"
#include "oracles/oracles.h"
#include "reference_cpu/reference.h"

namespace cutproof::guests {

Arrays arrays_of(const Dissected& dissected) {
  Arrays arrays = arrays_of(dissected.tissue);
  std::vector<int64_t> offsets = {0};
  std::vector<int32_t> members, number = dissected.number;
  for (const auto& cluster : dissected.clusters) {
    members.insert(members.end(), cluster.begin(), cluster.end());
    offsets.push_back(static_cast<int64_t>(members.size()));
  }
  if (number.empty()) {
    number.resize(dissected.clusters.size());
    std::iota(number.begin(), number.end(), 0);
  }
  const auto count = static_cast<int64_t>(dissected.clusters.size());
  arrays.push_back(make_array("offsets", {count + 1}, offsets));
  arrays.push_back(make_array("members", {offsets.back()}, members));
  arrays.push_back(make_array("number", {count}, number));
  return arrays;
}

Mat3 rotation_named(int64_t number) {
  Mat3 rotation;
  rotation.m = {};
  rotation.m[0] = static_cast<double>(number);
  return rotation;
}

State with_clusters(State state, const Array& offsets, const Array& members, const Array& number) {
  Clusters& clusters = state.clusters;
  const auto ends = offsets.of<int64_t>();
  clusters.offsets.assign(ends.begin(), ends.end());
  if (ends.empty()) clusters.offsets = {0};
  const auto particles = members.of<int32_t>();
  clusters.members.assign(particles.begin(), particles.end());
  const auto numbers = number.of<int32_t>();
  clusters.number.assign(numbers.begin(), numbers.end());
  const std::size_t count = clusters.offsets.size() - 1;
  clusters.rotation.assign(count, rotation_named(0));
  clusters.degenerate.assign(count, 0);
  clusters.rest_center.assign(count, {});
  clusters.mass.assign(count, 1);
  return state;
}

BeforeStage before_stage(const Question& question, bool rotations_are_told) {
  BeforeStage before;
  const Tissue tissue = tissue_of(question.given);
  before.setup.body = tissue.body;
  before.setup.skin.wanted = false;
  const auto limit = [&](const char* name) {
    const Array* const array = find_array(question.given, name);
    return array == nullptr ? 0 : static_cast<int32_t>(array->integer(0));
  };
  before.setup.split.debris = limit("debris");
  State& state = before.state;
  state.tau = limit("tau");
  state.cap = limit("cap");
  state.alive = tissue.alive;
  for (int32_t i = 0; i < tissue.body.particle_count(); ++i) state.x.push_back(tissue.body.rest_position(i));
  state.v.resize(state.x.size());
  state = with_clusters(std::move(state), *find_array(question.given, "offsets"),
                        *find_array(question.given, "members"), *find_array(question.given, "number"));
  for (std::size_t c = 0; rotations_are_told && c < state.clusters.number.size(); ++c) {
    state.clusters.rotation[c] = rotation_named(state.clusters.number[c]);
  }
  return before;
}

Arrays clusters_of(const State& state) {
  const Clusters& clusters = state.clusters;
  const int64_t count = clusters.count();
  return {make_array("offsets", {count + 1}, clusters.offsets),
          make_array("members", {clusters.offsets.back()}, clusters.members),
          make_array("number", {count}, clusters.number)};
}

std::string problem_of_dissected(const Question& question) {
  if (std::string problem = problem_of_body(question); !problem.empty()) return problem;
  for (const char* const name : {"debris", "tau", "cap"}) {
    const Array* const limit = find_array(question.given, name);
    if (limit != nullptr && limit->integer(0) < 0) return std::string("'") + name + "' is negative";
  }
  BeforeStage before = before_stage(question, false);
  // The new numbers of a split must fit.
  const std::vector<int32_t>& number = before.state.clusters.number;
  const auto most = static_cast<int64_t>(before.state.clusters.members.size());
  if (!number.empty() && number.back() + most > std::numeric_limits<int32_t>::max()) {
    return "'number' is so great that pieces of a cluster could not be numbered";
  }
  std::fill(before.state.alive.begin(), before.state.alive.end(), uint8_t{1});
  for (const Verdict& verdict :
       {oracles::well_formed(before.setup, before.state), oracles::cluster_connectivity(before.setup, before.state)}) {
    if (!verdict.holds) return verdict.witness.text;
  }
  const Clusters& clusters = before.state.clusters;
  std::vector<uint8_t> covered(before.state.alive.size(), 0);
  for (int32_t c = 0; c < clusters.count(); ++c) {
    const auto members = clusters.of(c);
    if (members.empty()) return "a cluster is empty";
    for (std::size_t k = 0; k < members.size(); ++k) {
      if (k > 0 && members[k] <= members[k - 1]) return "the members of a cluster do not ascend";
      covered[at(members[k])] = 1;
    }
  }
  const auto alive = find_array(question.given, "alive")->of<uint8_t>();
  for (std::size_t i = 0; i < covered.size(); ++i) {
    if (alive[i] > 1) return "'alive' is neither 0 nor 1";
    if (alive[i] != 0 && covered[i] == 0) return "particle " + std::to_string(i) + " lives and is in no cluster";
  }
  return "";
}

// --- Drawing ---------------------------------------------------------------------------------------------------------

std::vector<std::vector<int32_t>> balls(const Tissue& tissue, int32_t most_steps, Random& random) {
  std::vector<std::vector<int32_t>> clusters;
  std::vector<uint8_t> covered(tissue.alive.size(), 0);
  for (int32_t centre = 0; centre < tissue.body.particle_count(); ++centre) {
    if (tissue.alive[at(centre)] == 0 || covered[at(centre)] != 0) continue;
    std::vector<int32_t> ball = {centre};
    std::vector<uint8_t> met(tissue.alive.size(), 0);
    met[at(centre)] = 1;
    std::size_t begin = 0;
    for (int32_t steps = random.between(0, most_steps); steps > 0; --steps) {
      const std::size_t end = ball.size();
      for (; begin < end; ++begin) {
        for (const int32_t other : tissue.body.neighbours(ball[begin])) {
          if (met[at(other)] != 0 || tissue.alive[at(other)] == 0) continue;
          met[at(other)] = 1;
          ball.push_back(other);
        }
      }
    }
    std::sort(ball.begin(), ball.end());
    for (const int32_t i : ball) covered[at(i)] = 1;
    clusters.push_back(std::move(ball));
  }
  return clusters;
}

std::vector<std::vector<int32_t>> slabs(const Tissue& tissue, int32_t width, int32_t step) {
  std::vector<std::vector<int32_t>> clusters;
  const Grid& grid = tissue.body.grid;
  for (int32_t first = 1; first <= grid.nodes[0] - 2; first += step) {
    std::vector<int32_t>& cluster = clusters.emplace_back();
    for (int32_t i = 0; i < tissue.body.particle_count(); ++i) {
      const int32_t x = grid.coordinates(tissue.body.node[at(i)])[0];
      if (x >= first && x < first + width) cluster.push_back(i);
    }
  }
  return clusters;
}

std::vector<int32_t> numbers_with_gaps(std::size_t count, Random& random) {
  std::vector<int32_t> numbers;
  int32_t next = random.below(3);
  for (std::size_t c = 0; c < count; ++c) {
    numbers.push_back(next);
    next += random.between(1, 5);
  }
  return numbers;
}

Tissue draw_box(Random& random, int32_t most) {
  const int32_t a = random.between(2, most), b = random.between(2, most), c = random.between(1, most);
  std::vector<std::array<int32_t, 3>> nodes;
  for (int32_t z = 0; z < c; ++z) {
    for (int32_t y = 0; y < b; ++y) {
      for (int32_t x = 0; x < a; ++x) nodes.push_back({x, y, z});
    }
  }
  return on_grid(nodes, 0x1p-7);
}

namespace {

bool has_small_cluster(const State& state) {
  for (int32_t c = 0; c < state.clusters.count(); ++c) {
    if (state.clusters.size(c) < state.tau) return true;
  }
  return false;
}

// States before this stage of all frames that cut.
std::vector<State> moments(const property_tests::Instance& instance, Stage stage) {
  std::vector<State> found;
  const std::unique_ptr<Backend> backend = reference::make_backend();
  backend->load({instance.setup}, {instance.state});
  for (int64_t frame = 0; frame < instance.setup.frame_count(); ++frame) {
    const Stage last = stage == Stage::split ? Stage::detect : Stage::split;
    backend->run({Stage::step, last});
    State state = backend->snapshot().front();
    if (!state.removed.empty() && (stage == Stage::split || has_small_cluster(state))) {
      found.push_back(std::move(state));
    }
    backend->run({stage, Stage::skin});
  }
  return found;
}

}  // namespace

Dissected draw_dissection(Random& random, Stage stage, property_tests::ClusterKind clusters) {
  constexpr int kTrials = 10'000;  // about one in five has the wanted kind
  for (int trial = 0; trial < kTrials; ++trial) {
    const int size = random.between(4, 30);
    const auto seed =
        (static_cast<uint64_t>(random.below(1 << 30)) << 30) + static_cast<uint64_t>(random.below(1 << 30));
    property_tests::Case c = property_tests::draw_case(seed, size);
    c.clusters = clusters;
    property_tests::Instance instance = property_tests::instance_of(c);
    instance.setup.skin.wanted = false;
    std::vector<State> found = moments(instance, stage);
    if (found.empty()) continue;
    const State& state = found[at(random.below(static_cast<int32_t>(found.size())))];
    Dissected dissected;
    dissected.tissue = {instance.setup.body, state.alive};
    for (int32_t k = 0; k < state.clusters.count(); ++k) {
      const auto members = state.clusters.of(k);
      dissected.clusters.emplace_back(members.begin(), members.end());
    }
    dissected.number = state.clusters.number;
    dissected.debris = instance.setup.split.debris;
    dissected.tau = state.tau;
    dissected.cap = state.cap;
    return dissected;
  }
  throw std::logic_error("no random dissection cuts anything");
}

}  // namespace cutproof::guests
