# What add_subdirectory takes from an installed package: the target that find_package would give.
cmake_minimum_required(VERSION 3.21...4.2)
include(${CMAKE_CURRENT_LIST_DIR}/palpate-config.cmake)
set_target_properties(palpate::palpate PROPERTIES IMPORTED_GLOBAL TRUE)
