#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <string>

#include "tests/support/temporary_folder.h"

namespace hapticd::test {

/// Certificates of a lab in a separate folder.
class Lab {
 public:
  explicit Lab(const std::string& arguments = {}) { make(arguments); }
  void make(const std::string& arguments) const {
    const std::string command = "bash " SOURCE_FOLDER "/deploy/make_certificates.sh --lab optics --out " +
                                folder_.path("lab") + " " +
                                (arguments.empty() ? "--server localhost,127.0.0.1 --client operator/anna "
                                                     "--client observer/screen --client maintainer/otto"
                                                   : arguments) +
                                " > " + folder_.path("log") + " 2>&1";
    EXPECT_EQ(std::system(command.c_str()), 0) << command;
  }
  std::string server(const std::string& name = "localhost") const {
    return folder_.path("lab/servers/" + name);
  }
  std::string client(const std::string& name) const { return folder_.path("lab/clients/" + name); }

 private:
  TemporaryFolder folder_;
};

}  // namespace hapticd::test
