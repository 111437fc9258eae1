#include "oracles/iterates/probe.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <utility>

#include "oracles/iterates/substep_judge.h"
#include "oracles/noise.h"
#include "oracles/rounding.h"
#include "oracles/shape_sums.h"
#include "oracles/single_substep.h"
#include "oracles/support.h"

namespace cutproof::oracles {
namespace {

// As far apart two answers to one step may be [h] (tolerances.md, Against the reference).
constexpr double kSameEnd = 1e-4;

// Whether an iterate follows from the two before it.
bool combines_two(const Setup& setup) { return setup.step.acceleration == Acceleration::chebyshev; }

}  // namespace

IterateProbe::IterateProbe(const Setup& setup, const State& before, Iterates wanted, uint64_t seed)
    : setup_(setup), before_(before) {
  const int32_t substeps = setup.step.substeps, most = setup.step.iterations;
  if (wanted == Iterates::all) {
    for (int32_t s = 0; s < substeps; ++s) {
      wanted_.push_back({s, {}});
      for (int32_t k = 0; k <= most; ++k) wanted_.back().iterations.push_back(k);
    }
  } else {
    Noise noise(seed);
    const auto drawn = [&](int32_t count) {
      return std::min(static_cast<int32_t>((noise() + 1) / 2 * count), count - 1);
    };
    const auto add = [&](int32_t substep, int32_t k) {
      Wanted& of = wanted_.empty() || wanted_.back().substep != substep ? wanted_.emplace_back(Wanted{substep, {}})
                                                                        : wanted_.back();
      for (int32_t j = combines_two(setup) ? k - 1 : k; j <= k + 1; ++j) {
        if (j >= 0 && j <= most) of.iterations.push_back(j);
      }
    };
    const int32_t s = drawn(substeps);
    add(s, most > 0 ? drawn(most) : 0);
    wanted_.back().iterations.push_back(0);
    add(substeps - 1, std::max(most - 1, 0));
    for (Wanted& of : wanted_) {
      std::sort(of.iterations.begin(), of.iterations.end());
      of.iterations.erase(std::unique(of.iterations.begin(), of.iterations.end()), of.iterations.end());
    }
  }
  for (const Wanted& of : wanted_) {
    if (of.substep > 0) shown_.push_back({of.substep - 1, most});
    for (const int32_t k : of.iterations) shown_.push_back({of.substep, k});
  }
  std::sort(shown_.begin(), shown_.end());
  shown_.erase(std::unique(shown_.begin(), shown_.end()), shown_.end());
}

std::size_t IterateProbe::place_of(Shown wanted) const {
  return at(std::lower_bound(shown_.begin(), shown_.end(), wanted) - shown_.begin());
}

Setup IterateProbe::from_the_frame(Shown wanted) const {
  Setup cut = first_substeps(setup_, before_.frame, wanted.substep + 1);
  cut.withheld_iterations = setup_.step.iterations - wanted.iterations;
  return cut;
}

Setup IterateProbe::from_the_substep(Shown wanted) const {
  Setup single = frame_of_one_substep(setup_);
  take_substep(setup_, before_.frame, wanted.substep, single);
  single.step.iterations = wanted.iterations;
  return single;
}

std::vector<ShownStep> shown_iterates(Backend& backend, std::span<const IterateProbe> probes) {
  const Span step{Stage::step, Stage::step};
  const bool alone = backend.can_run(step);
  std::vector<Setup> setups;
  std::vector<State> states;
  const auto add = [&](Setup setup, State begin, int64_t frame = 0) {
    setups.push_back(alone ? std::move(setup) : step_alone(std::move(setup)));
    begin.frame = frame;
    states.push_back(std::move(begin));
    return states.size() - 1;
  };
  std::vector<ShownStep> shown(probes.size());
  // Bodies in which probes begin a frame, with their states after loading.
  const auto run = [&](const std::vector<std::size_t>& first) {
    std::vector<bool> wanted(setups.size());
    for (const std::size_t body : first) wanted[body] = true;
    backend.load(std::exchange(setups, {}), std::exchange(states, {}));
    if (!first.empty()) {
      std::vector<State> held = backend.snapshot_of(wanted);
      for (std::size_t p = 0; p < first.size(); ++p) shown[p].before = std::move(held[first[p]]);
    }
    backend.run(alone ? step : Span{Stage::step, Stage::skin});
    return backend.snapshot();
  };
  std::vector<std::size_t> first;
  if (backend.shows_iterates()) {
    for (const IterateProbe& probe : probes) {
      for (const auto& wanted : probe.shown_) {
        if (!probe.is_end(wanted)) add(probe.from_the_frame(wanted), probe.before_);
      }
      first.push_back(add(probe.setup_, probe.before_, probe.before_.frame));
    }
    std::vector<State> all = run(first);
    auto next = all.begin();
    for (std::size_t p = 0; p < probes.size(); ++p) {
      const auto end = all.begin() + static_cast<std::ptrdiff_t>(first[p]);
      shown[p].iterates.assign(std::make_move_iterator(next), std::make_move_iterator(end + 1));
      next = end + 1;
    }
    return shown;
  }
  // A substep at a time: all wanted iterates of it, and its end, from which the next one begins.
  std::vector<State> begin;
  int32_t most = 0;
  for (const IterateProbe& probe : probes) {
    begin.push_back(probe.before_);
    shown[begin.size() - 1].iterates.resize(probe.shown_.size());
    most = std::max(most, probe.setup_.step.substeps);
  }
  for (int32_t s = 0; s < most; ++s) {
    std::vector<std::pair<std::size_t, IterateProbe::Shown>> loaded;
    first.clear();
    for (std::size_t p = 0; p < probes.size(); ++p) {
      const int32_t last = probes[p].setup_.step.iterations;
      const auto want = [&](IterateProbe::Shown wanted) {
        loaded.emplace_back(p, wanted);
        return add(probes[p].from_the_substep(wanted), begin[p]);
      };
      for (const auto& wanted : probes[p].shown_) {
        if (wanted.substep == s && wanted.iterations != last) want(wanted);
      }
      if (s >= probes[p].setup_.step.substeps) continue;
      const std::size_t body = want({s, last});
      if (s == 0) first.push_back(body);
    }
    const std::vector<State> all = run(first);
    for (std::size_t k = 0; k < loaded.size(); ++k) {
      const auto& [p, wanted] = loaded[k];
      const std::size_t place = probes[p].place_of(wanted);
      if (place < probes[p].shown_.size() && probes[p].shown_[place] == wanted) shown[p].iterates[place] = all[k];
      if (wanted.iterations == probes[p].setup_.step.iterations) begin[p] = all[k];
    }
  }
  // In single precision, loading between substeps loses digits that the backend carries between them.
  if (backend.precision() == Precision::binary64) {
    for (const IterateProbe& probe : probes) add(probe.setup_, probe.before_, probe.before_.frame);
    std::vector<State> whole = run({});
    for (std::size_t p = 0; p < probes.size(); ++p) shown[p].whole = std::move(whole[p]);
  }
  return shown;
}

Witness IterateProbe::witness(const State& began, int32_t substep, const IterateFinding& found) const {
  Concerned concerned;
  std::string whose;
  switch (found.part) {
    case IteratePart::rotation:
    case IteratePart::orthogonal:
    case IteratePart::kept:
    case IteratePart::flag:
      concerned.clusters = {began.clusters.number[at(found.where)]};
      whose = fmt::format("of cluster {}", concerned.clusters.front());
      break;
    case IteratePart::sum:
    case IteratePart::pull:
      concerned.particles = {found.where};
      whose = fmt::format("of the component of particle {}", found.where);
      break;
    case IteratePart::impulse:
      whose = "of contacts";
      break;
    default:
      concerned.particles = {found.where};
      whose = fmt::format("of particle {}", found.where);
  }
  const std::string after = found.iteration < 0 ? "the prediction" : fmt::format("iteration {}", found.iteration + 1);
  const double h = setup_.body.grid.spacing;
  if (found.part == IteratePart::place || found.part == IteratePart::contact || found.part == IteratePart::velocity) {
    const char* times = found.part == IteratePart::velocity ? " times dt" : "";
    return witness_of(concerned,
                      "after {} of substep {}, the {} {}{} is {:.3g} h from the result that follows from the previous "
                      "iterate, rounding explains {:.3g} h",
                      after, substep + 1, name_of(found.part), whose, times, found.measured / h, found.bound / h);
  }
  return witness_of(concerned,
                    "after {} of substep {}, the {} {} is {:.3g} times as far as rounding explains from the result "
                    "that follows from the previous iterate",
                    after, substep + 1, name_of(found.part), whose, found.share);
}

// A backend that behaves otherwise when it is asked for iterates shows others than those of its frames.
void IterateProbe::compare_ends(const State& shown, const State& whole, Verdict& verdict) const {
  for (int32_t i = 0; i < setup_.body.particle_count(); ++i) {
    if (before_.alive[at(i)] == 0) continue;
    const double off = norm(shown.x[at(i)] - whole.x[at(i)]) / setup_.body.grid.spacing;
    ++verdict.checked;
    if (off <= kSameEnd) continue;
    verdict.measured = off / kSameEnd;
    return fail(verdict, {{}, {i}},
                "a run of this step that shows its iterates ends {:.3g} h from one that does not, at particle {}", off,
                i);
  }
}

// A backend may round the state that it is given once, and no more.
void IterateProbe::compare_loaded(const State& held, Verdict& verdict) const {
  const double u = unit_roundoff(held) + kUnitRoundoff, dt = setup_.substep_length[at(before_.frame)];
  Nearest nearest;
  for (int32_t i = 0; i < setup_.body.particle_count(); ++i) {
    if (before_.alive[at(i)] == 0) continue;
    const Vec3 x = before_.x[at(i)], v = before_.v[at(i)];
    const double of_place =
        u * norm(stored_place(setup_.body, held.precision, i, x)) + 2 * unit_of_places(held) * norm(x);
    nearest.see(norm(held.x[at(i)] - x), of_place, i);
    nearest.see(dt * norm(held.v[at(i)] - v), dt * u * norm(v), i);
    verdict.checked += 2;
  }
  verdict.measured = std::max(verdict.measured, nearest.share);
  if (nearest.holds()) return;
  fail(verdict, {{}, {nearest.where}},
       "particle {} is not loaded as it was given: its place, or its velocity times dt, is {:.3g} h off", nearest.where,
       nearest.measured / setup_.body.grid.spacing);
}

void IterateProbe::judge(const ShownStep& shown, Verdict& verdict) const {
  verdict.bound = 1;
  compare_loaded(shown.before, verdict);
  if (shown.whole && verdict.holds) compare_ends(shown.iterates.back(), *shown.whole, verdict);
  for (const Wanted& of : wanted_) {
    const auto state_after = [&](Shown wanted) -> const State& { return shown.iterates[place_of(wanted)]; };
    const State& began = of.substep == 0 ? shown.before : state_after({of.substep - 1, setup_.step.iterations});
    const auto state = [&](int32_t k) -> const State& { return state_after({of.substep, k}); };
    const auto shows = [&](int32_t k) { return std::binary_search(of.iterations.begin(), of.iterations.end(), k); };
    SubstepJudge judge(setup_, before_.frame, of.substep, began, shown.before);
    if (shows(0)) judge.prediction(state(0));
    for (int32_t k = 0; k < setup_.step.iterations; ++k) {
      const bool needs_earlier = k > 0 && combines_two(setup_);
      if (!shows(k) || !shows(k + 1) || (needs_earlier && !shows(k - 1))) continue;
      judge.iteration(k, needs_earlier ? &state(k - 1) : nullptr, state(k), state(k + 1));
    }
    verdict.checked += judge.checked();
    verdict.inconclusive += judge.inconclusive();
    const IterateFinding& worst = judge.worst();
    if (worst.share <= verdict.measured || !verdict.holds) continue;
    verdict.measured = worst.share;
    if (!worst.holds()) fail(verdict, witness(began, of.substep, worst));
  }
}

Verdict IterateProbe::judged(const ShownStep& shown) const {
  Verdict verdict = start_verdict(kStepByIterates, before_, kIteratesUnit, kIteratesSource);
  judge(shown, verdict);
  return conclude(std::move(verdict), kNoIterates);
}

}  // namespace cutproof::oracles
