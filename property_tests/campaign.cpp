#include "property_tests/campaign.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <new>
#include <thread>

#include "model/error.h"

namespace cutproof::property_tests {
namespace {

using Clock = std::chrono::steady_clock;
double seconds_since(Clock::time_point begin) { return std::chrono::duration<double>(Clock::now() - begin).count(); }

Judgement thrown(const std::string& backend, const std::string& what) {
  Judgement judgement;
  Verdict verdict;
  verdict.property = "runs to its end";
  verdict.backend = backend;
  verdict.holds = false;
  verdict.bound_source = "model/backend.h";
  verdict.witness.text = what;
  judgement.failure = std::move(verdict);
  return judgement;
}

// What `run` throws, in words; empty: nothing. What the machine throws goes on.
std::string problem_of(const std::function<void()>& run) {
  try {
    run();
    return {};
  } catch (const MachineError&) {
    throw;
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const Refused&) {
    throw;
  } catch (const std::exception& error) {
    return error.what();
  }
}

// Backends that nobody else uses for as long as they are lent.
class Pool {
 public:
  explicit Pool(int count) : idle_(at(count)) {}

  std::unique_ptr<Backend> take() {
    std::unique_lock lock(guard_);
    returned_.wait(lock, [&] { return !idle_.empty(); });
    std::unique_ptr<Backend> backend = std::move(idle_.back());
    idle_.pop_back();
    return backend;
  }
  void give(std::unique_ptr<Backend> backend) {
    {
      const std::lock_guard lock(guard_);
      idle_.push_back(std::move(backend));
    }
    returned_.notify_one();
  }

 private:
  std::mutex guard_;
  std::condition_variable returned_;
  std::vector<std::unique_ptr<Backend>> idle_;  // null: to be made
};

// A place in the pool, given back whatever happens; with its backend if that `works`: what threw is not used again.
struct Loan {
  explicit Loan(Pool& from) : pool(from), backend(from.take()) {}
  ~Loan() { pool.give(works ? std::move(backend) : nullptr); }
  Loan(const Loan&) = delete;
  Loan& operator=(const Loan&) = delete;
  Pool& pool;
  std::unique_ptr<Backend> backend;
  bool works = false;
};

// One load of cases.
struct Load {
  std::vector<int64_t> indices;
  std::vector<Case> cases;
  std::vector<Instance> loaded;
};

class Runner {
 public:
  Runner(const CampaignOptions& options, const BackendSource& source,
         const std::function<void(const Campaign&)>& progress)
      : options_(options), source_(source), progress_(progress), pool_(options.backends) {}

  Campaign run() {
    std::vector<std::thread> threads;
    for (int t = 0; t < options_.threads; ++t) threads.emplace_back([this] { work(); });
    for (std::thread& thread : threads) thread.join();
    if (error_) std::rethrow_exception(error_);
    auto& violations = campaign_.violations;
    std::sort(violations.begin(), violations.end(),
              [](const Violation& a, const Violation& b) { return a.index < b.index; });
    if (!options_.keep_going && violations.size() > 1) violations.erase(violations.begin() + 1, violations.end());
    campaign_.seconds = seconds_since(begin_);
    campaign_.stopped = stopped_;
    return std::move(campaign_);
  }

 private:
  void work() {
    try {
      while (!stop_) {
        const int64_t load = next_++;
        if (!run_load(load)) return;
      }
    } catch (...) {
      const std::lock_guard lock(guard_);
      if (!error_) error_ = std::current_exception();
      stop_ = true;
    }
  }

  // False: there is nothing left to do.
  bool run_load(int64_t number) {
    const Clock::time_point begin = Clock::now();
    if (options_.seconds && seconds_since(begin_) >= *options_.seconds) return false;
    if (options_.shard + number * options_.batch * options_.shards >= options_.cases || is_stopped()) return false;
    Load load;
    for (int64_t k = number * options_.batch; k < (number + 1) * options_.batch; ++k) {
      const int64_t index = options_.shard + k * options_.shards;
      if (index >= options_.cases) break;
      load.indices.push_back(index);
      load.cases.push_back(case_at(options_, index));
      load.loaded.push_back(property_tests::instance_of(load.cases.back()));
    }
    const double generating = seconds_since(begin);

    std::vector<CaseRun> runs;
    std::string name, problem;
    bool is_refused = false;
    double running = 0;
    {
      Loan loan(pool_);
      if (!loan.backend || source_.fresh) loan.backend = source_.make(number);
      name = loan.backend->name();
      const Clock::time_point running_since = Clock::now();
      try {
        problem = problem_of([&] { runs = run_cases(*loan.backend, load.loaded); });
      } catch (const Refused& refused) {  // which of the bodies shows where each is alone
        problem = refused.what();
        is_refused = true;
      }
      running = seconds_since(running_since);
      loan.works = problem.empty();
    }
    const Clock::time_point judging_since = Clock::now();
    std::vector<Judgement> judgements;
    for (std::size_t k = 0; k < load.cases.size() && !is_stopped(); ++k) {
      judgements.push_back(problem.empty() ? judge_case(load.cases[k], load.loaded[k], runs[k], name,
                                                        load.indices[k] % options_.thorough == 0)
                                           : dissect_alone([&] { return source_.make(number); }, load.cases[k], true));
    }
    if (!problem.empty() && !is_refused && judgements.size() == load.cases.size() &&
        std::none_of(judgements.begin(), judgements.end(), [](const Judgement& j) { return j.failure.has_value(); })) {
      judgements.front() = thrown(name, "(with the other bodies of its load only) " + problem);
    }
    note(load, judgements, generating, running, seconds_since(judging_since));
    return true;
  }

  // Once it is asked to stop, what is begun counts as far as it was judged.
  bool is_stopped() {
    if (is_asked(options_.stop_asked)) stopped_ = true;
    return stopped_;
  }

  // `judgements`: of the first cases of the load, or of all.
  void note(const Load& load, std::vector<Judgement>& judgements, double generating, double running, double judging) {
    const std::lock_guard lock(guard_);
    campaign_.generating += generating;
    campaign_.running += running;
    campaign_.judging += judging;
    for (std::size_t k = 0; k < judgements.size(); ++k) {
      Judgement& judgement = judgements[k];
      ++campaign_.cases;
      campaign_.verdicts += judgement.verdicts;
      campaign_.refused += judgement.refused ? 1 : 0;
      campaign_.particles += load.loaded[k].setup.body.particle_count();
      campaign_.coverage.add(judgement.coverage);
      campaign_.compared.join(judgement.compared);
      campaign_.properties.join(judgement.properties);
      campaign_.stages.join(judgement.stages);
      if (!judgement.failure) continue;
      campaign_.violations.push_back({load.indices[k], load.cases[k], std::move(*judgement.failure)});
      if (!options_.keep_going) stop_ = true;
    }
    campaign_.seconds = seconds_since(begin_);
    if (progress_) progress_(campaign_);
  }

  const CampaignOptions& options_;
  const BackendSource& source_;
  const std::function<void(const Campaign&)>& progress_;
  Pool pool_;
  Clock::time_point begin_ = Clock::now();
  std::atomic<int64_t> next_{0};  // loads are begun in order, so the first violation is found whatever comes after it
  std::atomic<bool> stop_{false}, stopped_{false};
  std::mutex guard_;
  Campaign campaign_;
  std::exception_ptr error_;
};

}  // namespace

Case case_at(const CampaignOptions& options, int64_t index) {
  const int64_t sizes = options.most_size - options.least_size + 1;
  const int size = options.least_size + static_cast<int>(index % sizes);
  const uint64_t seed = options.seed + static_cast<uint64_t>(index);
  return options.dynamics ? draw_moving_case(seed, size) : draw_case(seed, size);
}

Campaign run_campaign(const CampaignOptions& options, const BackendSource& source,
                      const std::function<void(const Campaign&)>& progress) {
  return Runner(options, source, progress).run();
}

namespace {

Judgement alone(const std::string& backend, const std::function<Judgement()>& judged) {
  Judgement judgement;
  try {
    const std::string problem = problem_of([&] { judgement = judged(); });
    return problem.empty() ? judgement : thrown(backend, problem);
  } catch (const Refused&) {
    judgement.refused = true;
    return judgement;
  }
}

}  // namespace

Judgement dissect_alone(const std::function<std::unique_ptr<Backend>()>& make, const Case& c, bool thorough) {
  const std::unique_ptr<Backend> backend = make();
  return alone(backend->name(), [&] { return dissect(*backend, c, thorough); });
}

Judgement history_alone(const std::function<std::unique_ptr<Backend>()>& make, const Case& c,
                        const std::vector<Command>& commands) {
  return alone(make()->name(), [&] {
    const History history = history_of(make, c, commands);
    Judgement judgement;
    judgement.verdicts = history.verdicts();
    judgement.failure = history.failure();
    return judgement;
  });
}

}  // namespace cutproof::property_tests
