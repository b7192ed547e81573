#!/usr/bin/env bash
# Build the drag's library for OpenFOAM: by wmake where the environment of an OpenFOAM is set, else
# for the package of Debian or Ubuntu, which has neither headers nor wmake, into openfoam/build.
#
# ARCH says which processors it is for (default: this one).
set -euo pipefail
cd "$(dirname "$0")"

if [ -n "${WM_PROJECT_DIR:-}" ] && command -v wmake >/dev/null; then
	# Versions of www.openfoam.com are v1912 or v2506, those of openfoam.org 11 or 13.
	case "$WM_PROJECT_VERSION" in
	v*) exec wmake libso . ;;
	esac
	exec wmake libso foundation
fi

ARCH=${ARCH:--march=native}
install="apt-get update && apt-get install -y --no-install-recommends openfoam"
if ! command -v icoUncoupledKinematicParcelFoam >/dev/null; then
	if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
		echo "There is no OpenFOAM here; installing the package openfoam"
		{ apt-get update && apt-get install -y --no-install-recommends openfoam; } >/dev/null
	else
		echo "There is no OpenFOAM here. Set the environment of yours, or, on Debian or Ubuntu:" >&2
		echo "  sudo sh -c '$install'" >&2
		exit 1
	fi
fi
if ! command -v g++ >/dev/null; then
	echo "A C++ compiler is needed, and there is no g++" >&2
	exit 1
fi

mkdir -p build
version=$(dpkg-query -W -f '${source:Version}' openfoam)
headers=build/include-$version
if [ ! -d "$headers" ]; then
	echo "Fetching the headers of OpenFOAM $version"
	# Where the package itself came from, as a source of sources: for this one call of apt.
	source=$(apt-cache policy openfoam |
		awk '$2 ~ /^http/ { split($3, suite, "/"); print $2, suite[1], suite[2]; exit }')
	rm -rf build/source
	mkdir -p build/source/lists/partial
	echo "deb-src $source" >build/source/sources.list
	apt="apt-get -qq -o Dir::Etc::sourcelist=$PWD/build/source/sources.list
		-o Dir::Etc::sourceparts=- -o Dir::State::lists=$PWD/build/source/lists
		-o APT::Sandbox::User=root"
	$apt update
	(cd build/source && $apt source --download-only "openfoam=$version" &&
		tar xjf openfoam_*.orig.tar.bz2 --wildcards '*/src/*')
	rm -rf "$headers.new"
	for library in OpenFOAM OSspecific/POSIX finiteVolume meshTools lagrangian/basic \
		lagrangian/intermediate lagrangian/distributionModels thermophysicalModels/basic \
		thermophysicalModels/specie thermophysicalModels/SLGThermo thermophysicalModels/radiation \
		transportModels/compressible regionModels/regionModel regionModels/surfaceFilmModels \
		dynamicMesh dynamicFvMesh fileFormats surfMesh sampling; do
		# OpenFOAM's sources include each other by bare names: one flat folder a library.
		mkdir -p "$headers.new/$library"
		find build/source/*/src/"$library" \( -name lnInclude -o -name Make -o -name MSwindows \) \
			-prune -o -type f \( -name '*.H' -o -name '*.C' -o -name '*.h' \) -print0 |
			xargs -0 cp -t "$headers.new/$library"
	done
	rm -rf build/source
	mv "$headers.new" "$headers"
fi

# As OpenFOAM's own rules compile, but for the processor. Never -ffast-math: OpenFOAM traps
# floating-point exceptions, and exact ties between neighbours have to stay ties.
flags="-std=c++11 -O3 $ARCH -fno-math-errno -fPIC -pthread -DOPENFOAM=${version%%.*} -DWM_DP
	-DWM_LABEL_SIZE=32 -DNoRepository"
includes=$(find "$headers" -mindepth 1 -type d -printf '-isystem %p ')
for cloud in basicKinematicCloud basicKinematicCollidingCloud; do
	# shellcheck disable=SC2086
	g++ $flags -Wall -Wextra $includes -I../cpp -I. -c $cloud.C -o build/$cloud.o
done
g++ -shared build/basicKinematic*.o -llagrangianIntermediate -llagrangian -lfiniteVolume -lmeshTools \
	-lOpenFOAM -o build/libneighbourDrag.new.so
mv build/libneighbourDrag.new.so build/libneighbourDrag.so
echo "Built $PWD/build/libneighbourDrag.so for OpenFOAM ${version%%.*}"
