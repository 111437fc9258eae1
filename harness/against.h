// `cutproof run --against reference`: a backend's run beside the reference's, in lockstep, free-running or both.
#pragma once
#include <cstdint>
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
  // Registers a listener of the reference's states: of lockstep if requested, else of the free run.
  void observe_reference(std::function<void(Stage, const State&)> observer);
  // `by_backend`: false of a stage that the reference ran for the backend, which is not compared.
  void see(Stage stage, const State& after, bool launched, bool by_backend = true);
  // A comparison of stages of which the backend ran none does not hold.
  std::vector<Verdict> verdicts() const;
  bool holds() const;

 private:
  std::string backend_;
  int64_t compared_ = 0, left_ = 0;  // stages
};

}  // namespace cutproof::harness
