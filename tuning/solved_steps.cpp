#include "tuning/solved_steps.h"

#include <cmath>
#include <stdexcept>
#include <utility>

#include "oracles/comparison/reference_solution.h"
#include "oracles/single_substep.h"
#include "reference_cpu/reference.h"

namespace cutproof::tuning {

SolvedSteps::SolvedSteps() : reference_(reference::make_backend()) {}

bool SolvedSteps::can_run(Span span) const { return span.first == Stage::step && span.last == Stage::skin; }

void SolvedSteps::load(std::vector<Setup> setups, std::vector<State> states) {
  for (const Setup& setup : setups) {
    if (setup.step.solver != Solver::implicit) {
      throw std::invalid_argument("solved steps: only the implicit solver has an answer");
    }
  }
  setups_ = std::move(setups);
  states_ = std::move(states);
}

void SolvedSteps::run(Span span) {
  if (!can_run(span)) throw std::logic_error("solved steps: only whole frames are run");
  for (std::size_t b = 0; b < setups_.size(); ++b) {
    if (states_[b].frame >= setups_[b].frame_count()) continue;
    step(setups_[b], states_[b]);
    reference_->load({setups_[b]}, {std::move(states_[b])});
    reference_->run({Stage::detect, Stage::skin});
    states_[b] = std::move(reference_->snapshot().front());
  }
}

void SolvedSteps::step(const Setup& setup, State& state) {
  const int64_t frame = std::exchange(state.frame, 0);
  state.removed.clear();
  state.debris.clear();
  state.impulse = {};
  cutproof::Setup single = oracles::frame_of_one_substep(setup);
  for (int32_t s = 0; s < setup.step.substeps; ++s) {
    oracles::take_substep(setup, frame, s, single);
    oracles::SubstepAnswer answer = oracles::substep_answer(single, state);
    ++count_.substeps;
    count_.by_iteration += answer.by == oracles::SolvedBy::iteration;
    count_.unsolved += !answer.converged;
    const double dt = single.substep_length.front(), decay = std::exp(-setup.step.damping * dt);
    Vec3 pushed;  // push of contacts and grips: nothing else changes Σ m x of x~
    for (std::size_t i = 0; i < state.x.size(); ++i) {
      if (state.alive[i] == 0) continue;
      const Vec3 moved = answer.x[i] - state.x[i];
      pushed += setup.body.mass[i] * (moved - dt * state.v[i] - (dt * dt) * setup.step.gravity);
      state.v[i] = (decay / dt) * moved;
    }
    state.impulse = decay * (state.impulse + pushed / dt);
    state.x = std::move(answer.x);
    state.clusters.rotation = std::move(answer.rotation);
  }
  state.frame = frame;
}

}  // namespace cutproof::tuning
