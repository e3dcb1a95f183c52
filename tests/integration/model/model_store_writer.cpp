// Writes models and tags to a store until it is killed, and shows each write once it was acknowledged.
//
//   model_store_writer STORE FIRST
#include <cstdio>
#include <cstdlib>
#include <string>

#include "server/model/store/model_store.h"
#include "tests/support/model_examples.h"

using namespace hapticd;

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  auto store = server::ModelStore::open(argv[1]);
  if (!store) {
    std::printf("refused %s\n", store.error().text().c_str());
    return 1;
  }
  const auto fail = [](const server::Refusal& refusal) {
    std::printf("refused %s\n", refusal.error.text().c_str());
    return 1;
  };
  for (int i = std::atoi(argv[2]);; ++i) {
    const auto model = (*store)->add(test::example_contact("sponge", i));
    if (!model) return fail(model.refusal());
    std::printf("model %s\n", model->hash.c_str());
    std::fflush(stdout);
    const auto tagged = (*store)->tag(model->hash, "current");
    if (!tagged) return fail(tagged.refusal());
    std::printf("tag %s\n", model->hash.c_str());
    std::fflush(stdout);
    if (i % 3 == 2) {
      const auto ended = (*store)->record_identification(
          {"contact-" + std::to_string(i), "contact", "sponge", "converged", i, model->hash, ""});
      if (!ended) return fail(ended.refusal());
      std::printf("ended contact-%d\n", i);
      std::fflush(stdout);
    }
  }
}
