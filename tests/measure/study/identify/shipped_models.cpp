#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>

#include "server/model/model_file.h"
#include "tests/measure/study/common/palpation.h"
#include "tests/measure/study/common/parts.h"
#include "tests/measure/study/common/scenes.h"

namespace hapticd::study {

void run_identify_shipped_models(StudyContext& context) {
  const std::filesystem::path folder = context.report.folder() / "shipped_models";
  std::filesystem::create_directories(folder);
  for (const std::string& object : explored_objects()) {
    std::ofstream file(folder / (object + ".toml"));
    file << server::write_model(identify(object).model);
    if (!file.flush()) throw std::runtime_error("cannot write " + (folder / (object + ".toml")).string());
  }
  context.report.say("shipped_models/*.toml are those of server/model/shipped.");
}

}  // namespace hapticd::study
