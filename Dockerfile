# An image with the program: `docker build -t cutproof .`, with a package in dist/ or from sources. The script is tried by
# ci/bare.sh on a bare Debian 12; no image has been built of this file yet.
FROM debian:12
COPY . /cutproof
RUN /cutproof/ci/demo.sh
