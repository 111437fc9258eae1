// `cutproof run --against reference`: a backend's run beside the reference's, in lockstep, free-running or both.
#pragma once
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
  void see(Stage stage, const State& after, bool launched);
  std::vector<Verdict> verdicts() const;
  bool holds() const;
};

}  // namespace cutproof::harness
