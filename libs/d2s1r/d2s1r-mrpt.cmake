# d2s1r_find_mrpt(module...) finds modules of MRPT 2 (packages mrpt-maps, ...; targets mrpt::maps, ...) or of MRPT 3
# (packages mrpt_maps, ...; targets mrpt::mrpt_maps, ...), whichever CMake meets first, and names the targets as MRPT 2
# does. What can be drawn is module opengl of MRPT 2, viz of MRPT 3. Used by the build and by the installed package.
macro(d2s1r_find_mrpt)
  foreach(d2s1r_module ${ARGN})
    string(REPLACE opengl viz d2s1r_module_of_3 ${d2s1r_module})
    if(NOT TARGET mrpt::${d2s1r_module})
      find_package(mrpt_${d2s1r_module_of_3} 2.5 REQUIRED NAMES mrpt_${d2s1r_module_of_3} mrpt-${d2s1r_module})
    endif()
    if(NOT TARGET mrpt::${d2s1r_module})
      add_library(mrpt::${d2s1r_module} ALIAS mrpt::mrpt_${d2s1r_module_of_3})
    endif()
  endforeach()
endmacro()
