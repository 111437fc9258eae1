// Arrays with names, as they cross a border: to plugins and back, to files of others and back.
#pragma once
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

namespace cutproof {

// Numbered as in cutproof/plugin.h.
enum class ElementType : int32_t { i32 = 1, i64, u8, f32, f64 };

constexpr int64_t size_of(ElementType type) {
  return type == ElementType::u8 ? 1 : type == ElementType::i32 || type == ElementType::f32 ? 4 : 8;
}
constexpr std::string_view name_of(ElementType type) {
  constexpr std::string_view names[] = {"int32", "int64", "uint8", "float32", "float64"};
  return names[static_cast<std::size_t>(type) - 1];
}

template <class T>
constexpr ElementType element_type() {
  if constexpr (std::is_same_v<T, int32_t>) return ElementType::i32;
  if constexpr (std::is_same_v<T, int64_t>) return ElementType::i64;
  if constexpr (std::is_same_v<T, uint8_t>) return ElementType::u8;
  if constexpr (std::is_same_v<T, float>) return ElementType::f32;
  if constexpr (std::is_same_v<T, double>) return ElementType::f64;
}

// Dense, row by row: the last index runs fastest.
struct Array {
  std::string name;
  ElementType type = ElementType::f64;
  std::vector<int64_t> shape;    // [rows], [rows, columns], … ; all >= 0
  std::vector<std::byte> bytes;  // of as many elements as `shape` says

  int64_t rows() const { return shape.empty() ? 1 : shape[0]; }
  // Elements of one row.
  int64_t columns() const {
    int64_t columns = 1;
    for (std::size_t k = 1; k < shape.size(); ++k) columns *= shape[k];
    return columns;
  }
  int64_t count() const {
    int64_t count = 1;
    for (const int64_t extent : shape) count *= extent;
    return count;
  }
  // Throws std::logic_error if it holds elements of another type.
  template <class T>
  std::span<const T> of() const {
    if (type != element_type<T>()) throw std::logic_error("The array " + name + " holds " + std::string(name_of(type)));
    return {reinterpret_cast<const T*>(bytes.data()), bytes.size() / sizeof(T)};
  }
  // Element k, whatever the type.
  double number(int64_t k) const { return element<double>(k); }
  int64_t integer(int64_t k) const { return element<int64_t>(k); }

  friend bool operator==(const Array&, const Array&) = default;

 private:
  template <class T>
  T element(int64_t k) const {
    const auto i = static_cast<std::size_t>(k);
    switch (type) {
      case ElementType::i32:
        return static_cast<T>(of<int32_t>()[i]);
      case ElementType::i64:
        return static_cast<T>(of<int64_t>()[i]);
      case ElementType::u8:
        return static_cast<T>(of<uint8_t>()[i]);
      case ElementType::f32:
        return static_cast<T>(of<float>()[i]);
      case ElementType::f64:
        return static_cast<T>(of<double>()[i]);
    }
    return {};
  }
};
using Arrays = std::vector<Array>;

template <class T>
Array make_array(std::string name, std::vector<int64_t> shape, const std::vector<T>& values) {
  Array array{std::move(name), element_type<T>(), std::move(shape), {}};
  array.bytes.resize(values.size() * sizeof(T));
  if (!values.empty()) std::memcpy(array.bytes.data(), values.data(), array.bytes.size());
  return array;
}

// Null if there is none of that name.
inline const Array* find_array(const Arrays& arrays, std::string_view name) {
  for (const Array& array : arrays) {
    if (array.name == name) return &array;
  }
  return nullptr;
}

}  // namespace cutproof
