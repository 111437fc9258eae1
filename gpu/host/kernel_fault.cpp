#include "gpu/host/kernel_fault.h"

#include <bit>
#include <cstdio>
#include <cstring>

namespace cutproof::gpu {

namespace {

// In the order of the enumerators.
constexpr const char* kOperationNames[] = {"sync", "sum", "smallest", "any", "exclusive_scan", "ballot", "shuffle"};

bool of_warp(Operation operation) { return operation == Operation::ballot || operation == Operation::shuffle; }

}  // namespace

std::string list(std::uint32_t mask) {
  std::string text = std::popcount(mask) == 1 ? "thread " : "threads ";
  bool first = true;
  while (mask != 0) {
    const int begin = std::countr_zero(mask);
    const int length = std::countr_one(mask >> begin);
    if (!first) text += ',';
    first = false;
    text += std::to_string(begin);
    if (length > 1) text += '-' + std::to_string(begin + length - 1);
    mask = length == 32 ? 0 : mask & ~(((1u << length) - 1) << begin);
  }
  return text;
}

std::string describe(const Meeting& meeting) {
  const char* file = meeting.where.file;
  const char* slash = std::strrchr(file, '/');
  std::string text = kOperationNames[static_cast<int>(meeting.operation)];
  if (of_warp(meeting.operation)) {
    char mask[16];
    std::snprintf(mask, sizeof mask, "0x%08x", meeting.mask);
    text += std::string(" with mask ") + mask;
  }
  return text + " (" + (slash != nullptr ? slash + 1 : file) + ':' + std::to_string(meeting.where.line) + ')';
}

std::string place_of(const Job& job, const LiveBlock& block) {
  return std::string(job.kernel) + ", block " + std::to_string(block.index) + " of " + std::to_string(job.blocks);
}

std::string describe_stop(const Job& job, const LiveBlock& block) {
  std::string text = place_of(job, block) + ": not all threads that must meet do:";
  std::uint32_t rest = block.waiting;
  while (rest != 0) {
    const Meeting& meeting = block.meeting[std::countr_zero(rest)];
    std::uint32_t group = 0;
    for (int t = 0; t < kHostThreads; ++t) {
      if ((rest & bit(t)) != 0 && same(block.meeting[t], meeting)) group |= bit(t);
    }
    text.append(" ").append(list(group)).append(" at ").append(describe(meeting)).append(";");
    rest &= ~group;
  }
  if (block.done != 0) text.append(" ").append(list(block.done)).append(" ended;");
  text.back() = '.';
  return text;
}

}  // namespace cutproof::gpu
