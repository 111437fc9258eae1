// Neighbouring lanes of a warp that do one small job together: a group of particles, a cluster of groups. A warp has
// several teams, which need not do the same at the same time.
//
// On the host a team is one thread, because meetings of fibres cost more than such a job. Its sums keep one bank for
// each lane of the device and combine them in the same order, so both give the same bits.
#pragma once
#include <cstdint>

#include "gpu/launch/block.h"

namespace cutproof::gpu {

template <int N>
struct Floats {
  float v[N];
};

// kWidth: 1, 2, 4, 8, 16 or 32 lanes.
template <class Block, int kWidth>
class Team {
 public:
  static constexpr int kLanes = Block::on_device ? kWidth : 1;  // threads of a team

  CUTPROOF_DEVICE explicit Team(Block& block) : block_(block) {}

  // For grid-stride loops over jobs of a team each.
  CUTPROOF_DEVICE int64_t first() const { return block_.first() / kLanes; }
  CUTPROOF_DEVICE int64_t stride() const { return block_.stride() / kLanes; }
  CUTPROOF_DEVICE int lane() const { return block_.lane() % kLanes; }
  CUTPROOF_DEVICE bool leads() const { return lane() == 0; }
  // Whether each() gives item k to this lane.
  CUTPROOF_DEVICE bool has(int k) const { return k % kLanes == lane(); }

  // visit(k) for this lane's items of [0, count), ascending.
  template <class Visit>
  CUTPROOF_DEVICE void each(int count, Visit visit) const {
    for (int k = lane(); k < count; k += kLanes) visit(k);
  }

  // use(k, ask(k)) for the same items. Several are asked before the first is used: one by one, each would wait for the
  // previous one. ask() may be called more than once for an item.
  template <int kAtOnce, class Ask, class Use>
  CUTPROOF_DEVICE void each_asked(int count, Ask ask, Use use) const {
    for (int begin = lane(); begin < count; begin += kAtOnce * kLanes) {
      decltype(ask(0)) asked[kAtOnce];
      for (int t = 0; t < kAtOnce; ++t) {
        const int k = begin + t * kLanes;
        asked[t] = ask(k < count ? k : begin);
      }
      for (int t = 0; t < kAtOnce; ++t) {
        const int k = begin + t * kLanes;
        if (k < count) use(k, asked[t]);
      }
    }
  }

  // visit(i), by the whole team, for the wanted i of [0, count). The lanes ask about items far apart, because wanted
  // items are adjacent.
  template <class Wanted, class Visit>
  CUTPROOF_DEVICE void each_wanted(int64_t count, Wanted wanted, Visit visit) const {
    for (int64_t begin = first(); begin < count; begin += kLanes * stride()) {
      const int64_t own = begin + lane() * stride();
      const bool is = own < count && wanted(static_cast<int>(own));
      unsigned lanes = found(is);
      while (lanes != 0) visit(take(lanes, static_cast<int>(own)));
    }
  }

  // N sums over items. Item k adds to of(k), in the order of each(). The order of addition is that of kOrder lanes: if
  // the team is narrower, each lane does the work of several. So teams of several widths give the same bits.
  template <int N, int kOrder = kWidth>
  class Sums {
   public:
    CUTPROOF_DEVICE float* of(int k) {
      static_assert(kOrder == kWidth);
      return bank_[k % kBanks].v;
    }

   private:
    friend class Team;
    static_assert(kOrder % kWidth == 0);
    static constexpr int kBanks = kOrder / kLanes;
    Floats<N> bank_[kBanks] = {};
  };
  // visit(k, bank, sums) for this lane's items: those of the bank-th lane that it stands for, and their sums.
  template <int N, int kOrder, class Visit>
  CUTPROOF_DEVICE void each(Sums<N, kOrder>& sums, int count, Visit visit) const {
    for (int begin = lane(); begin < count; begin += kOrder) {
      for (int bank = 0; bank < kOrder / kLanes; ++bank) {
        const int k = begin + bank * kLanes;
        if (k < count) visit(k, bank, sums.bank_[bank].v);
      }
    }
  }
  // To every lane.
  template <int N, int kOrder>
  CUTPROOF_DEVICE Floats<N> total(Sums<N, kOrder>& sums) const {
    add_banks(sums);
    for (int distance = kLanes / 2; distance > 0; distance /= 2) {
      for (int k = 0; k < N; ++k) sums.bank_[0].v[k] += other(sums.bank_[0].v[k], distance);
    }
    return sums.bank_[0];
  }

  // The same sums with a third of the exchanges, each in one lane only.
  template <int N>
  class Parted {
   public:
    // give(n, sum) for this lane's sums; give(n, sum, sum of `other`).
    template <class Give>
    CUTPROOF_DEVICE void each(const Team& team, Give give) const {
      each_own(team, [&](int n, int k) { give(n, value_[k]); });
    }
    template <class Give>
    CUTPROOF_DEVICE void each(const Team& team, const Parted& other, Give give) const {
      each_own(team, [&](int n, int k) { give(n, value_[k], other.value_[k]); });
    }
    // Sum n, to every lane.
    CUTPROOF_DEVICE float get(const Team& team, int n) const {
      return team.from(n / kOwn * kShare, value_[Block::on_device ? n % kOwn : n]);
    }

   private:
    friend class Team;
    static constexpr int kMost = 16;
    static constexpr int kShare = kWidth > kMost ? kWidth / kMost : 1;  // lanes with the same sums at the end…
    static constexpr int kOwn = kWidth < kMost ? kMost / kWidth : 1;    // … and the number of these sums
    static_assert(N <= kMost);
    // visit(n, k) for this lane's sums n, as value_[k].
    template <class Visit>
    CUTPROOF_DEVICE static void each_own(const Team& team, Visit visit) {
      if constexpr (Block::on_device) {
        for (int k = 0; k < kOwn; ++k) {
          const int which = team.lane() / kShare * kOwn + k;
          if (team.lane() % kShare == 0 && which < N) visit(which, k);
        }
      } else {
        for (int k = 0; k < N; ++k) visit(k, k);
      }
    }
    float value_[Block::on_device ? kOwn : N] = {};
  };
  template <int N, int kOrder>
  CUTPROOF_DEVICE Parted<N> parted(Sums<N, kOrder>& sums) const {
    Parted<N> found;
    if constexpr (Block::on_device) {
      add_banks(sums);
      // Each lane keeps half of its sums, the upper half if `distance` is in its number, and adds those of the lane at
      // that distance.
      constexpr int kMost = Parted<N>::kMost;
      float kept[kMost];
      for (int k = 0; k < kMost; ++k) kept[k] = k < N ? sums.bank_[0].v[k < N ? k : 0] : 0.0f;
      int half = kMost / 2;
      for (int distance = kWidth / 2; distance > 0; distance /= 2, half /= 2) {
        if (half == 0) {
          kept[0] += other(kept[0], distance);
          continue;
        }
        const bool upper = (lane() & distance) != 0;
        for (int k = 0; k < kMost / 2; ++k) {
          if (k >= half) break;
          const float sent = upper ? kept[k] : kept[k + half], mine = upper ? kept[k + half] : kept[k];
          kept[k] = mine + other(sent, distance);
        }
      }
      for (int k = 0; k < Parted<N>::kOwn; ++k) found.value_[k] = kept[k];
    } else {
      const Floats<N> all = total(sums);
      for (int k = 0; k < N; ++k) found.value_[k] = all.v[k];
    }
    return found;
  }

  // Collectives, reached by all lanes of the team; the result goes to each of them.
  CUTPROOF_DEVICE float greatest(float value) const {  // not of NaN
    if constexpr (Block::on_device) {
      for (int distance = kWidth / 2; distance > 0; distance /= 2) value = fmaxf(value, other(value, distance));
    }
    return value;
  }
  CUTPROOF_DEVICE bool any(bool value) const {
    if constexpr (kLanes > 1) return block_.ballot(mask(), value) != 0;
    return value;
  }
  // All lanes see what its lanes have written so far.
  CUTPROOF_DEVICE void sync() const {
    if constexpr (kLanes > 1) block_.sync_warp(mask());
  }
  // The value of the lane with item k.
  template <class T>
  CUTPROOF_DEVICE T from(int k, T value) const {
    if constexpr (kLanes == 1) return value;
    return block_.shuffle(mask(), value, (block_.lane() & ~(kWidth - 1)) + k % kWidth);
  }
  // The lanes, as bits, that have found a job for the whole team, and the first one's job, which is then cleared.
  CUTPROOF_DEVICE unsigned found(bool mine) const {
    if constexpr (Block::on_device) return block_.ballot(mask(), mine);
    return mine ? 1u : 0u;
  }
  CUTPROOF_DEVICE int take(unsigned& lanes, int job) const {
    const unsigned first = lanes & (~lanes + 1);
    lanes &= lanes - 1;
    if constexpr (Block::on_device) return block_.shuffle(mask(), job, ones(first - 1));
    return job;
  }
  // To every lane; exact for integers only, because the device's lanes and the host's one have different terms.
  CUTPROOF_DEVICE int total(int value) const {
    if constexpr (Block::on_device) {
      for (int distance = kWidth / 2; distance > 0; distance /= 2) value += other(value, distance);
    }
    return value;
  }
  // Of the lanes before this one.
  CUTPROOF_DEVICE int total_before(int value) const {
    if constexpr (Block::on_device) {
      int through = value;
      for (int distance = 1; distance < kWidth; distance *= 2) {
        const int before =
            block_.shuffle(mask(), through, lane() >= distance ? block_.lane() - distance : block_.lane());
        if (lane() >= distance) through += before;
      }
      return through - value;
    }
    return 0;
  }
  // Of the lanes with the same value: the first (from 0), the number before this one, and their number.
  struct Equals {
    int first, before, count;
  };
  CUTPROOF_DEVICE Equals equals(int value) const {
    if constexpr (Block::on_device) {
      const unsigned same = block_.match(mask(), value) >> (block_.lane() & ~(kWidth - 1));
      return {ones((same & (~same + 1)) - 1), ones(same & ((1u << lane()) - 1)), ones(same)};
    }
    return {0, 0, 1};
  }
  // The number of lanes before this one with a true value, and of all such lanes.
  CUTPROOF_DEVICE int rank(bool value, int& total) const {
    if constexpr (Block::on_device) {
      const unsigned votes = block_.ballot(mask(), value) >> (block_.lane() & ~(kWidth - 1));
      total = ones(votes);
      return ones(votes & ((1u << lane()) - 1u));
    }
    total = value ? 1 : 0;
    return 0;
  }

 private:
  CUTPROOF_DEVICE unsigned mask() const {
    return (kWidth == 32 ? 0xffffffffu : (1u << (kWidth % 32)) - 1u) << (block_.lane() & ~(kWidth - 1));
  }
  // Combines a lane's banks into its first, as the lanes would that it stands for.
  template <int N, int kOrder>
  CUTPROOF_DEVICE static void add_banks(Sums<N, kOrder>& sums) {
    for (int half = kOrder / kLanes / 2; half > 0; half /= 2) {
      for (int bank = 0; bank < half; ++bank) {
        for (int k = 0; k < N; ++k) sums.bank_[bank].v[k] += sums.bank_[bank + half].v[k];
      }
    }
  }
  template <class T>
  CUTPROOF_DEVICE T other(T value, int distance) const {
    return block_.shuffle(mask(), value, block_.lane() ^ distance);
  }
  CUTPROOF_DEVICE static int ones(unsigned bits) {
#if defined(__CUDA_ARCH__)
    return __popc(bits);
#else
    int count = 0;
    for (; bits != 0; bits &= bits - 1) ++count;
    return count;
#endif
  }

  Block& block_;
};

}  // namespace cutproof::gpu
