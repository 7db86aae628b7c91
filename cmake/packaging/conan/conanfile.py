# SPDX-License-Identifier: BSD-3-Clause
"""Conan 2 recipe:  conan create cmake/packaging/conan [-o "orbis/*:compiled=True"]"""
import os

from conan import ConanFile
from conan.tools.build import check_min_cppstd
from conan.tools.cmake import CMake, CMakeDeps, CMakeToolchain, cmake_layout
from conan.tools.files import copy

required_conan_version = ">=2.0"

# Option of the recipe, component of the library, requirement.
OPTIONAL = {
    "with_io": ("io", ["libpng/[>=1.6 <2]", "libjpeg-turbo/[>=2.1 <4]", "tomlplusplus/[>=3.3 <4]"]),
    "with_nanoflann": ("cloud_nanoflann", ["nanoflann/[>=1.4 <2]"]),
    "with_octomap": ("interop_octomap", ["octomap/[>=1.9 <2]"]),
    "with_opencv": ("interop_opencv", ["opencv/[>=4.5 <5]"]),
}
COMPONENTS = ["core", "camera", "features", "places", "optimize", "cloud", "octree", "eval", "slam", "mapping", "nav"]


class Orbis(ConanFile):
    name = "orbis"
    version = "0.2.0"
    license = "BSD-3-Clause"
    description = "Header-only C++20 algorithms for RGB-D SLAM and mapping"
    topics = ("slam", "rgbd", "octree", "mapping", "robotics", "header-only")
    settings = "os", "arch", "compiler", "build_type"
    options = {"compiled": [True, False], **{name: [True, False] for name in OPTIONAL}}
    default_options = {"compiled": False, "with_io": True, "with_nanoflann": False, "with_octomap": False,
                       "with_opencv": False}

    def export_sources(self):
        root = os.path.join(self.recipe_folder, "..", "..", "..")
        for pattern in ("CMakeLists.txt", "LICENSE", "cmake/*", "include/*"):
            copy(self, pattern, src=root, dst=self.export_sources_folder)

    def configure(self):
        self.package_type = "static-library" if self.options.compiled else "header-library"

    def layout(self):
        cmake_layout(self)

    def validate(self):
        check_min_cppstd(self, 20)

    def requirements(self):
        self.requires("eigen/[>=3.4 <4]", transitive_headers=True)
        self.requires("tl-expected/[>=1.0 <2]", transitive_headers=True)
        for name, (_, packages) in OPTIONAL.items():
            if self.options.get_safe(name):
                for package in packages:
                    self.requires(package, transitive_headers=True, transitive_libs=True)

    def package_id(self):
        if not self.info.options.compiled:
            self.info.clear()

    def components(self):
        return COMPONENTS + [component for name, (component, _) in OPTIONAL.items() if self.options.get_safe(name)]

    def generate(self):
        CMakeDeps(self).generate()
        toolchain = CMakeToolchain(self)
        toolchain.cache_variables["ORBIS_COMPONENTS"] = ";".join(self.components())
        toolchain.cache_variables["ORBIS_BUILD_COMPILED"] = bool(self.options.compiled)
        toolchain.cache_variables["ORBIS_LIBDEFLATE"] = False
        for programs in ("TESTS", "BENCH", "EXAMPLES"):
            toolchain.cache_variables[f"ORBIS_BUILD_{programs}"] = False
        toolchain.generate()

    def build(self):
        cmake = CMake(self)
        cmake.configure()
        cmake.build()

    def package(self):
        copy(self, "LICENSE", src=self.source_folder, dst=os.path.join(self.package_folder, "licenses"))
        CMake(self).install()

    def package_info(self):
        # The package files of the project, which define the components.
        self.cpp_info.set_property("cmake_find_mode", "none")
        self.cpp_info.builddirs = [os.path.join("share", "cmake", "orbis")]
        if not self.options.compiled:
            self.cpp_info.libdirs = []
            self.cpp_info.bindirs = []
