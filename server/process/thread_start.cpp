#include "server/process/thread_start.h"

namespace hapticd::server {

hal::Error no_thread_left(const std::system_error& failure) {
  return {"the machine gives hapticd no further thread", "threads", failure.code().message(),
          "the limit of its user or of its unit",
          "end what else runs as this user, or raise ulimit -u, LimitNPROC= or TasksMax="};
}

}  // namespace hapticd::server
