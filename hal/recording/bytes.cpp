#include "hal/recording/bytes.h"

namespace hapticd::recording {

void put_texts(const Texts& texts, std::string& out) {
  std::string inner;
  for (const auto& [key, value] : texts) {
    put_text(key, inner);
    put_text(value, inner);
  }
  put_text(inner, out);
}

Texts ByteReader::take_texts() {
  ByteReader inner(take_text());
  Texts texts;
  while (!inner.rest().empty()) {
    std::string key(inner.take_text());
    std::string value(inner.take_text());
    if (inner.failed()) {
      failed_ = true;
      return {};
    }
    texts.emplace(std::move(key), std::move(value));
  }
  return texts;
}

}  // namespace hapticd::recording
