#include "server/process/version.h"

namespace hapticd::server {

const char* version() {
  return HAPTICD_VERSION;
}

}  // namespace hapticd::server
