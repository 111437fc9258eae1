// Setups and snapshots as strings of all their bits: == on these tells NaN from NaN and 0 from -0.
#pragma once
#include <string>
#include <type_traits>
#include <vector>

#include "model/fields.h"
#include "model/io/recording.h"
#include "model/setup_fields.h"

namespace cutproof::io {

class Bits {
 public:
  template <class T>
  Bits& add(const T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
    return *this;
  }
  template <class T>
  Bits& add(const std::vector<T>& values) {
    add(values.size());
    if (!values.empty()) bytes_.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
    return *this;
  }
  Bits& add(const std::string& text) {
    add(text.size());
    bytes_ += text;
    return *this;
  }
  const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
};

inline std::string bits_of(const Snapshot& snapshot) {
  Bits bits;
  bits.add(snapshot.stage);
  for_each_field([&](const Field&, auto get) { bits.add(get(snapshot.state)); });
  return bits.bytes();
}

inline std::string bits_of(const Setup& setup) {
  Bits bits;
  for_each_setup_field([&](const SetupField&, auto get) {
    const auto& value = get(setup);
    using T = std::remove_cvref_t<decltype(value)>;
    if constexpr (is_list_of_entries<T>) {
      for (const auto& entry : value) {
        for_each_entry_field<typename T::value_type>([&](const SetupField&, auto of) { bits.add(of(entry)); });
      }
    } else {
      bits.add(value);
    }
  });
  return bits.bytes();
}

}  // namespace cutproof::io
