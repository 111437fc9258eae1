#include "property_tests/checking.h"

#include <algorithm>
#include <cstdlib>
#include <iostream>
#include <sstream>

#include "gpu/backends.h"
#include "harness/backends.h"

namespace cutproof::property_tests {

void showValue(const Case& c, std::ostream& os) { os << to_json(c); }

// --- Settings -----------------------------------------------------------------------------------------------------

namespace {

int64_t number_from_environment(const char* name, int64_t otherwise) {
  const char* text = std::getenv(name);
  return text == nullptr ? otherwise : std::stoll(text);
}

// RC_PARAMS as it was given.
std::string g_rapidcheck_parameters;

}  // namespace

int64_t wanted_cases() { return number_from_environment("CUTPROOF_CASES", 2000); }
uint64_t wanted_seed() { return static_cast<uint64_t>(number_from_environment("CUTPROOF_SEED", 1)); }

void set_up_rapidcheck() {
  if (const char* given = std::getenv("RC_PARAMS")) g_rapidcheck_parameters = given;
  // Without a seed rapidcheck takes one from the clock.
  if (g_rapidcheck_parameters.empty()) setenv("RC_PARAMS", ("seed=" + std::to_string(wanted_seed())).c_str(), 1);
}

void PrintTo(const NamedBackend& backend, std::ostream* os) { *os << backend.name; }

std::vector<NamedBackend> all_backends() {
  std::vector<NamedBackend> tested;
  const auto add = [&](const harness::BackendDescriptor& backend, const char* variant, const char* schedule,
                       int64_t fraction, int most_size) {
    harness::BackendChoice choice;
    choice.name = backend.name;
    choice.schedule = schedule;
    choice.seed = wanted_seed();
    choice.threads = 2;
    std::string name = choice.name + variant;
    std::replace(name.begin(), name.end(), '-', '_');  // GoogleTest takes no others
    tested.push_back({std::move(name), [choice] { return harness::make_backend(choice); }, fraction, most_size});
  };
  for (const harness::BackendDescriptor& backend : harness::backends()) {
    if (!backend.is_built() || (backend.needs_device() && harness::processor_of(backend).empty())) continue;
    if (backend.takes_schedule) {
      add(backend, "_random", "random", 2, 35);
      add(backend, "_pct", "pct", 2, 35);
    } else if (backend.is_another_path && !backend.needs_device()) {
      add(backend, "", "", 10, 100);
    } else if (backend.is_timed) {
      add(backend, "", "", 1, 100);
    }
  }
  // The kernels' other way of splitting, which only large clusters take otherwise.
  gpu::KernelOptions global;
  global.split = gpu::SplitMethod::global_labels;
  tested.push_back({"host_global_labels", [=] { return gpu::make_host_backend(2, global); }, 4, 100});
  tested.push_back(
      {"simulated_reverse",
       [=] { return gpu::make_simulated_backend({.schedule = gpu::reverse(), .step_budget = 5'000'000'000}, global); },
       2, 35});
#if CUTPROOF_HAS_CUDA
  std::string why;
  if (!gpu::device_description(why).empty()) {
    tested.push_back({"gpu_global_labels", [=] { return gpu::make_gpu_backend(global); }, 4, 100});
  }
#endif
  return tested;
}

std::string EveryBackend::id() const {
  const auto* test = ::testing::UnitTest::GetInstance()->current_test_info();
  return std::string(test->test_suite_name()) + "." + test->name();
}

int64_t EveryBackend::cases_of(int64_t fraction) const {
  return std::max<int64_t>(wanted_cases() / (fraction * GetParam().fraction), 5);
}

bool EveryBackend::ran_in_full() const {
  return g_rapidcheck_parameters.empty() && wanted_cases() >= 2000 && GetParam().fraction == 1 && !HasFailure();
}

INSTANTIATE_TEST_SUITE_P(Over, EveryBackend, ::testing::ValuesIn(all_backends()),
                         [](const auto& tested) { return tested.param.name; });

// --- Cases for rapidcheck -----------------------------------------------------------------------------------------

void Deadline::start() {
  constexpr std::chrono::seconds kShrinkingTime{60};
  if (!at) at = std::chrono::steady_clock::now() + kShrinkingTime;
}

namespace {

// The sequence of simpler cases.
class SimplerCases {
 public:
  SimplerCases(Case c, std::shared_ptr<const Deadline> deadline)
      : case_(std::move(c)),
        edits_(std::make_shared<const std::vector<std::function<void(Case&)>>>(simplifications(case_))),
        deadline_(std::move(deadline)) {}
  rc::Maybe<Case> operator()() {
    while (next_ < edits_->size() && !deadline_->is_over()) {
      Case simpler = case_;
      (*edits_)[next_++](simpler);
      if (!(simpler == case_)) return simpler;
    }
    return rc::Nothing;
  }

 private:
  Case case_;
  std::shared_ptr<const std::vector<std::function<void(Case&)>>> edits_;
  std::shared_ptr<const Deadline> deadline_;
  std::size_t next_ = 0;
};

}  // namespace

rc::Gen<Case> random_cases(std::shared_ptr<const Deadline> deadline, Draw draw) {
  return [deadline, draw](const rc::Random& random, int size) {
    rc::Random source(random);
    return rc::shrinkable::shrinkRecur(
        draw(source.next(), size), [deadline](Case c) { return rc::makeSeq<SimplerCases>(std::move(c), deadline); });
  };
}

// --- Checking -----------------------------------------------------------------------------------------------------

void check(const std::string& id, int64_t attempts, int most_size, Deadline& deadline, const Attempt& attempt) {
  namespace detail = rc::detail;
  detail::TestMetadata metadata;
  metadata.id = metadata.description = id;
  detail::TestParams params = detail::configuration().testParams;
  if (g_rapidcheck_parameters.find("max_success") == std::string::npos) params.maxSuccess = static_cast<int>(attempts);
  params.maxSize = std::min(params.maxSize, most_size);
  std::cout << id << ": seed " << params.seed << ", " << params.maxSuccess << " cases" << std::endl;

  std::string simplest;
  const auto testable = [&] {
    const Example example = attempt();
    if (example.problem.empty()) return;
    deadline.start();
    simplest = example.line;
    RC_FAIL(example.problem);
  };
  const detail::TestResult result = detail::checkTestable(testable, metadata, params);
  if (result.is<detail::SuccessResult>()) return;

  std::ostringstream message;
  detail::printResultMessage(result, message);
  if (result.is<detail::FailureResult>()) {
    detail::Configuration replay;
    replay.reproduce[id] = result.get<detail::FailureResult>().reproduce;
    std::istringstream parameters(detail::configToMinimalString(replay));
    std::string reproduce;  // the seed that follows it plays no part
    while (parameters >> reproduce && reproduce.rfind("reproduce=", 0) != 0) {
    }
    message << "\nReplay: RC_PARAMS=\"" << reproduce << "\" property_tests --gtest_filter='" << id << "'"
            << "\nTo keep it, save this line as fixtures/regressions/NAME.json (replayed first on every run):\n"
            << simplest << "\n";
  }
  ADD_FAILURE() << message.str();
}

void check(const std::string& id, int64_t cases, int most_size, const Property& property) {
  const auto deadline = std::make_shared<Deadline>();
  const auto cases_of = random_cases(deadline);
  check(id, cases, most_size, *deadline, [&] {
    const Case c = *cases_of;
    try {
      return Example{to_json(c), property(c)};
    } catch (const std::exception& error) {
      return Example{to_json(c), std::string("throws: ") + error.what()};
    }
  });
}

}  // namespace cutproof::property_tests
