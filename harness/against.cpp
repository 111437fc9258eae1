#include "harness/against.h"

#include <algorithm>
#include <utility>

namespace cutproof::harness {

Against::Against(const Setup& setup, const State& start, const State& loaded, const std::string& backend,
                 AgainstMode mode)
    : backend_(backend) {
  if (mode != AgainstMode::free_running) lockstep.emplace(setup, start, loaded, backend);
  if (mode != AgainstMode::lockstep) free_running.emplace(setup, start, loaded, backend);
}

void Against::observe_reference(std::function<void(Stage, const State&)> observer) {
  if (lockstep) {
    lockstep->observe_reference(std::move(observer));
  } else if (free_running) {
    free_running->observe_reference(std::move(observer));
  }
}

void Against::see(Stage stage, const State& after, bool launched, bool by_backend) {
  ++(by_backend ? compared_ : left_);
  if (lockstep) lockstep->see(stage, after, launched, by_backend);
  if (free_running) free_running->see(stage, after);
}

std::vector<Verdict> Against::verdicts() const {
  std::vector<Verdict> verdicts;
  if (lockstep) verdicts = lockstep->verdicts();
  if (free_running) verdicts.push_back(free_running->verdict());
  if (compared_ == 0 && left_ > 0) {
    verdicts.push_back({.property = "something was compared",
                        .backend = backend_,
                        .holds = false,
                        .bound = 1,
                        .unit = "1",
                        .bound_source = "oracles.md, A whole run",
                        .checked = 1,
                        .witness = {{}, {}, {}, "the backend ran no stage: the reference ran all of them for it"}});
  }
  return verdicts;
}

bool Against::holds() const {
  const auto all = verdicts();
  return std::all_of(all.begin(), all.end(), [](const Verdict& verdict) { return verdict.holds; });
}

}  // namespace cutproof::harness
