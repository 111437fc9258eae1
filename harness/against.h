// `cutproof run --against reference`: a backend's run beside the reference's, in lockstep, free-running or both.
#pragma once
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "harness/free_running.h"
#include "harness/lockstep.h"

namespace cutproof::harness {

enum class AgainstMode { lockstep, free_running, both };

struct Against {
  // Those that were asked for.
  std::optional<Lockstep> lockstep;
  std::optional<FreeRunning> free_running;

  // Parameters as the two classes have them.
  Against(const Setup& setup, const State& start, const State& loaded, const std::string& backend, AgainstMode mode);
  // From now on: told the reference's states, of lockstep where that was asked for, else of the free run.
  void observe_reference(std::function<void(Stage, const State&)> observer);
  void see(Stage stage, const State& after, bool launched);
  std::vector<Verdict> verdicts() const;
  bool holds() const;
};

}  // namespace cutproof::harness
