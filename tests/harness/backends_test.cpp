// Every backend is what its description says.
#include "harness/backends.h"

#include <gtest/gtest.h>

#include <set>

#include "model/error.h"
#include "tests/program.h"

namespace backends_test {
namespace {

using namespace cutproof::harness;
using cutproof::kStages;
using cutproof::Span;
using cutproof::Stage;

// Where there is no device, those that need one are not made.
std::vector<const BackendDescriptor*> backends_of_this_machine() {
  std::vector<const BackendDescriptor*> found;
  for (const BackendDescriptor& backend : backends()) {
    if (backend.is_built() && !processor_of(backend).empty()) found.push_back(&backend);
  }
  return found;
}

BackendChoice choice_of(const BackendDescriptor& backend) {
  BackendChoice choice;
  choice.name = backend.name;
  return choice;
}

TEST(Backends, HaveTheArithmeticOfTheirDescriptionAndRunEverySpan) {
  ASSERT_GE(backends_of_this_machine().size(), 3U);
  for (const BackendDescriptor* const described : backends_of_this_machine()) {
    const auto backend = make_backend(choice_of(*described));
    EXPECT_EQ(backend->precision(), described->precision) << described->name;
    for (const Stage first : kStages) {
      for (const Stage last : kStages) {
        if (first > last) continue;
        EXPECT_TRUE(backend->can_run({first, last})) << described->name;
      }
    }
  }
}

TEST(Backends, HaveNamesOfTheirOwnAndOneReference) {
  std::set<std::string_view> names;
  int references = 0;
  for (const BackendDescriptor& backend : backends()) {
    EXPECT_TRUE(names.insert(backend.name).second) << backend.name;
    EXPECT_EQ(find_backend(backend.name), &backend);
    EXPECT_FALSE(backend.summary.empty());
    EXPECT_GT(backend.timed_frames, 0);
    EXPECT_GT(backend.bodies_in_a_load, 0);
    references += backend.is_the_reference;
  }
  EXPECT_EQ(references, 1);
  EXPECT_TRUE(reference_backend().is_the_reference);
  EXPECT_EQ(find_backend("nobody"), nullptr);
}

// Loads beside each other: no two share threads, and each has a schedule of its own.
TEST(Backends, AreMadeForLoadsBesideEachOther) {
  for (const BackendDescriptor& backend : backends()) {
    const BackendChoice first = choice_for_load(choice_of(backend), 0), second = choice_for_load(choice_of(backend), 1);
    EXPECT_EQ(first.threads, backend.processor == Processor::all_threads ? 1 : 0) << backend.name;
    EXPECT_EQ(first.seed != second.seed && first.schedule != second.schedule, backend.takes_schedule) << backend.name;
  }
}

using BackendsOfTheProgram = Program;

TEST_F(BackendsOfTheProgram, AreListedByInfoByHelpAndWhereOneIsUnknown) {
  const Outcome info = cutproof("info"), help = cutproof("run --help"),
                unknown = cutproof("run x.json --backend nobody");
  EXPECT_EQ(unknown.status, 2);
  for (const BackendDescriptor& backend : backends()) {
    for (const Outcome* const outcome : {&info, &help, &unknown}) {
      EXPECT_NE(outcome->output.find(backend.name), std::string::npos) << backend.name << " in:\n" << outcome->output;
    }
    const std::string summary = backend.is_built() ? std::string(backend.summary) : "not built";
    EXPECT_NE(on_one_line(info.output).find(summary), std::string::npos) << summary << " in:\n" << info.output;
  }
}

TEST_F(BackendsOfTheProgram, AreTimedOnlyIfWhatTheyTakeSaysSomething) {
  for (const BackendDescriptor& backend : backends()) {
    if (backend.is_timed) continue;
    for (const char* command : {"bench stages --sizes 1000 --backend ", "bench machine_limits --backend "}) {
      expect_refused(command + std::string(backend.name), {std::string(backend.name), "finding faults"});
    }
  }
}

}  // namespace
}  // namespace backends_test
