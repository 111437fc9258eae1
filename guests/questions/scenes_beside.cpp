// Runs beside that of a scene: the same with one piece kicked, and mirrored (docs/reference/plugins.md, Whole
// simulators).
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "guests/questions/kinds.h"
#include "guests/questions/scenes.h"
#include "guests/tissue_arrays.h"
#include "harness/foreign_run.h"
#include "harness/related_runs.h"
#include "model/at.h"
#include "model/error.h"
#include "model/precision.h"
#include "model/words.h"
#include "oracles/relations/kick.h"

namespace cutproof::guests::scenes {

uint32_t scene_promises(std::string_view words) {
  std::vector<std::string_view> known(oracles::kRunPromises.begin(), oracles::kRunPromises.end());
  known.insert(known.end(), {"no_ghost_force", "mirror"});
  uint32_t promises = 0;
  for (const std::string_view word : words_in(words)) {
    for (std::size_t k = 0; k < known.size(); ++k)
      promises |= static_cast<uint32_t>(word == known[k] || word == "*") << k;
  }
  return promises;
}

namespace {

constexpr const char *kGhost = "no ghost force", *kMirrored = "mirrored run";
constexpr double kNoNumber = std::numeric_limits<double>::quiet_NaN();

Verdict not_judged(const char* property, const char* why) {
  Verdict verdict;
  verdict.property = property;
  verdict.vacuous = why;
  return verdict;
}

Question with_scene(Question question, const Scene& scene, Precision precision) {
  question.given.clear();
  for (Array& array : arrays_of(scene)) question.given.push_back(as_it_is_given(std::move(array), precision));
  return question;
}

// How the scene fell apart, and at the end which particles are surely in which piece.
struct Apart {
  oracles::RunPieces pieces;
  std::vector<int32_t> piece;  // -1: none for sure
};
Apart apart_of(std::vector<io::ArrayFile> frames) {
  Apart apart;
  const harness::JudgedRun judged =
      harness::judge_run(io::RunSegments("the run", std::move(frames)),
                         [&](int64_t, const oracles::RunJudge& judge) { apart.piece = judge.piece_of_particles(); });
  apart.pieces = judged.pieces;
  return apart;
}

// [frames][n][3] of the particles that a run ever has; NaN before one is there.
std::vector<double> places_of(const std::vector<io::ArrayFile>& run, std::size_t n) {
  std::vector<double> places;
  for (const io::ArrayFile& frame : run) {
    std::vector<double> now = numbers_of(vectors_of(*find_array(frame.arrays, "positions")));
    now.resize(3 * n, kNoNumber);
    places.insert(places.end(), now.begin(), now.end());
  }
  return places;
}

// The smallest piece that can be kicked: away from all others, so that none is touched.
Scene kicked_scene(const Scene& scene, const Apart& apart) {
  std::map<int32_t, std::vector<int32_t>> free;
  for (int32_t i = 0; i < scene.count(); ++i) {
    if (apart.piece[at(i)] >= 0 && scene.held[at(i)] == 0) free[apart.piece[at(i)]].push_back(i);
  }
  Scene kicked = scene;
  const auto smallest = std::min_element(
      free.begin(), free.end(), [](const auto& a, const auto& b) { return a.second.size() < b.second.size(); });
  if (smallest == free.end()) return kicked;
  Vec3 inside, outside;
  double others = 0;
  for (int32_t i = 0; i < scene.count(); ++i) {
    const bool is_inside = apart.piece[at(i)] == smallest->first;
    (is_inside ? inside : outside) += scene.rest[at(i)];
    others += is_inside ? 0 : 1;
  }
  const Vec3 away =
      inside / std::max(1.0, static_cast<double>(scene.count()) - others) - outside / std::max(1.0, others);
  const Vec3 direction = norm(away) > 0 ? normalized(away) : Vec3{1, 0, 0};
  for (const int32_t i : smallest->second) kicked.kick[at(i)] = direction * (0.1 * scene.h / scene.frame_time);
  // After the last cut: further cuts depend on the places of pieces.
  for (std::size_t k = 0; k < scene.blade.size(); ++k) {
    if (std::isfinite(scene.blade[k].x)) kicked.kick_frame = static_cast<int64_t>(k) / (4 * scene.blades) + 1;
  }
  return kicked;
}

std::vector<Verdict> judge_kicked(const Question& question, const std::vector<io::ArrayFile>& run, const Apart& apart,
                                  Precision precision, const AskBeside& ask) {
  // How early chance begins in a run so short, one repeat does not show.
  if ((find_array(question.known, "promises")->integer(0) >> static_cast<int>(oracles::RunPromise::deterministic) &
       1) == 0)
    return {not_judged(kGhost, "needs the promise 'deterministic'")};
  const Scene scene = scene_of(question.given), kicked = kicked_scene(scene, apart);
  if (apart.pieces.pieces < 2) return {not_judged(kGhost, "there is one piece")};
  if (kicked.kick_frame < 0) return {not_judged(kGhost, "no piece is free")};
  if (kicked.kick_frame >= scene.frames) return {not_judged(kGhost, "a blade is there in the last frame")};
  const Question next = with_scene(question, kicked, precision);
  const std::optional<Arrays> answers = ask(next);
  if (!answers) return {unreadable(kGhost, "it does not answer the scene with a kick")};
  const RunFiles with = run_files(next, *answers, precision);
  if (!with.problem.empty()) return {unreadable(kGhost, "with a piece kicked, " + with.problem)};
  oracles::KickedRuns runs;
  const std::size_t n = apart.piece.size();
  runs.frames = std::ssize(run);
  runs.particles = static_cast<int32_t>(n);
  runs.positions = places_of(run, n);
  runs.kicks.emplace_back().positions = places_of(with.frames, n);
  runs.piece = apart.piece;
  runs.spacing = scene.h;
  runs.precision = precision;
  for (std::size_t i = 0; i < kicked.kick.size(); ++i) {
    if (kicked.kick[i] != Vec3{}) runs.kicks.front().piece = apart.piece[i];
  }
  // Particles that are not certainly in a piece are ignored.
  for (const io::ArrayFile& frame : run) {
    const Array* const alive = find_array(frame.arrays, "alive");
    const std::size_t there = vectors_of(*find_array(frame.arrays, "positions")).size();
    for (std::size_t i = 0; i < n; ++i) {
      const bool is_alive = i < there && (alive == nullptr || alive->integer(static_cast<int64_t>(i)) != 0);
      runs.alive.push_back(is_alive && apart.piece[i] >= 0 ? 1 : 0);
    }
  }
  const oracles::KickReport report = oracles::judge_kick(runs);
  std::vector<Verdict> verdicts = report.kicks.empty() ? std::vector<Verdict>{} : report.kicks.front().verdicts;
  for (const Verdict& verdict : report.verdicts) {
    if (!verdict.holds) verdicts.push_back(unreadable(kGhost, "with a piece kicked, " + verdict.witness.text));
  }
  return verdicts;
}

// Of a node and its mirror image along x: 4 k, so that a grid of twice the spacing is its own image.
int32_t mirror_sum(const Scene& scene) { return (scene.nodes[0] + 2) / 4 * 4; }
double mirrored_place(const Scene& scene, double x) { return scene.h * mirror_sum(scene) - x; }

Scene mirrored_scene(Scene scene) {
  for (Vec3& x : scene.rest) x.x = mirrored_place(scene, x.x);
  for (Vec3& x : scene.blade) x.x = mirrored_place(scene, x.x);
  for (Vec3& v : scene.velocity) v.x = -v.x;
  for (std::size_t i = 0; i < scene.rest.size(); ++i) scene.node[3 * i] = mirror_sum(scene) - scene.node[3 * i];
  scene.nodes[0] = mirror_sum(scene) + 1;
  scene.gravity.x = -scene.gravity.x;
  // Corners, so that volumes stay positive.
  for (std::size_t k = 0; k < scene.tetrahedra.size(); k += 4) std::swap(scene.tetrahedra[k], scene.tetrahedra[k + 1]);
  for (std::size_t k = 0; k < scene.hexahedra.size(); k += 4) std::swap(scene.hexahedra[k + 1], scene.hexahedra[k + 3]);
  return scene;
}

// Its answer, mirrored back. Corners of cells are sets.
Arrays mirrored_answers(const Scene& scene, Arrays answers) {
  for (Array& array : answers) {
    const bool is_place = array.name == "run/position", is_axial = array.name == "run/spin";
    if (!is_place && !is_axial && array.name != "run/velocity" && array.name != "run/contact_impulse") continue;
    std::vector<Vec3> vectors = vectors_of(array);
    for (Vec3& v : vectors) {
      if (is_axial)
        v = {v.x, -v.y, -v.z};
      else
        v.x = is_place ? mirrored_place(scene, v.x) : -v.x;
    }
    array = make_array(array.name, array.shape, numbers_of(vectors));
  }
  return answers;
}

// Each place and velocity another by a unit in the last place, or as it is.
Scene disturbed_scene(Scene scene, Precision precision, uint64_t seed) {
  Random random(seed);
  const auto disturb = [&](double& x) {
    x *= 1 + 2 * unit_roundoff(precision) * (static_cast<double>(random.below(3)) - 1);
  };
  for (std::vector<Vec3>* const vectors : {&scene.rest, &scene.velocity}) {
    for (Vec3& v : *vectors) disturb(v.x), disturb(v.y), disturb(v.z);
  }
  return scene;
}

Verdict judge_mirrored(const Question& question, const std::vector<io::ArrayFile>& run, const Apart& apart,
                       Precision precision, const AskBeside& ask) {
  // Which way a decision falls that rounding makes is no matter of the mirror: neither where tissue is cut, nor in
  // which frame, where one sweep ends on an edge and the next goes on there.
  if (apart.pieces.ever_perhaps_cut > 0 || apart.pieces.beside > 0)
    return not_judged(kMirrored, "in some frame it is open which tissue the blade cuts");
  const Scene scene = scene_of(question.given);
  const std::optional<Arrays> answers = ask(with_scene(question, mirrored_scene(scene), precision));
  if (!answers) return unreadable(kMirrored, "it does not answer the mirrored scene");
  const RunFiles back = run_files(question, mirrored_answers(scene, *answers), precision);
  if (!back.problem.empty()) return unreadable(kMirrored, "mirrored, " + back.problem);
  const auto judge = [&](std::vector<io::RunSegments> noise) {
    const harness::JudgedRelation judged =
        harness::judge_relation(oracles::RunMap(), io::RunSegments("the run", run),
                                io::RunSegments("the mirrored run", back.frames), std::move(noise));
    Verdict worst;
    for (const Verdict& verdict : judged.verdicts) {
      // Groups may follow a grid, to which rounding assigns a particle between two cells.
      if (verdict.property == "something was judged" || verdict.property == "related coupling") continue;
      if (!verdict.holds || verdict.property == "related positions") worst = verdict;
      if (!verdict.holds) break;
    }
    return worst;
  };
  Verdict worst = judge({});
  if (!worst.holds) {
    // Contacts amplify rounding: how much, say runs that are disturbed by it.
    std::vector<io::RunSegments> noise;
    for (uint64_t seed = 1; seed <= 2; ++seed) {
      const std::optional<Arrays> other = ask(with_scene(question, disturbed_scene(scene, precision, seed), precision));
      if (!other) return unreadable(kMirrored, "it does not answer the scene that is moved by rounding");
      RunFiles files = run_files(question, *other, precision);
      if (!files.problem.empty()) return unreadable(kMirrored, "moved by rounding, " + files.problem);
      noise.emplace_back("the disturbed run", std::move(files.frames));
    }
    worst = judge(std::move(noise));
  }
  if (!worst.holds) worst.witness.text = fmt::format("mirrored, {}: {}", worst.property, worst.witness.text);
  worst.property = kMirrored;
  return worst;
}

}  // namespace

std::vector<Verdict> judge_runs_beside(const Question& question, const Arrays& answers, Precision precision,
                                       const AskBeside& ask) {
  const int64_t promises = find_array(question.known, "promises")->integer(0);
  if ((promises & (kPromisesNoGhostForce | kPromisesMirror)) == 0) return {};
  const RunFiles run = run_files(question, answers, precision);
  if (!run.problem.empty()) return {};  // a verdict by itself
  Apart apart;
  try {
    apart = apart_of(run.frames);
  } catch (const InputError&) {
    return {};  // said of the run
  }
  if (apart.piece.empty()) return {};  // likewise
  std::vector<Verdict> verdicts;
  if ((promises & kPromisesNoGhostForce) != 0) verdicts = judge_kicked(question, run.frames, apart, precision, ask);
  if ((promises & kPromisesMirror) != 0) {
    try {
      verdicts.push_back(judge_mirrored(question, run.frames, apart, precision, ask));
    } catch (const InputError& error) {
      verdicts.push_back(unreadable(kMirrored, fmt::format("mirrored, {}", error.what())));
    }
  }
  return verdicts;
}

}  // namespace cutproof::guests::scenes
