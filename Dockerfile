# The bench with the graphics drivers that it renders with on any machine: no graphics card is needed.
#   docker build -t refseq .
#   docker run --rm --user "$(id -u):$(id -g)" --volume "$PWD:/bench" refseq demo
FROM python:3.11-slim-bookworm AS build
WORKDIR /checkout
RUN python -m venv /opt/refseq
ENV PATH=/opt/refseq/bin:$PATH PIP_DISABLE_PIP_VERSION_CHECK=1 PIP_NO_CACHE_DIR=1
# The lock's versions of what the bench needs, without its developers' tools: a folder has no hash, so pip would take none.
COPY requirements.lock ./
RUN sed -E 's/ *\\$//; /^ +--hash/d' requirements.lock >versions.txt
COPY . .
RUN pip install --constraint versions.txt .

FROM python:3.11-slim-bookworm
# The packages that `refseq doctor` asks for; of Debian's versions, as a security update must not break this line.
# hadolint ignore=DL3008
RUN apt-get update \
    && apt-get install -y --no-install-recommends \
        libegl1 \
        libgl1-mesa-dri \
        libopengl0 \
        libvulkan1 \
        mesa-vulkan-drivers \
    && rm -rf /var/lib/apt/lists/*
COPY --from=build /opt/refseq /opt/refseq
# Any user may run it: caches are where all may write, as is the folder of the results.
ENV PATH=/opt/refseq/bin:$PATH XDG_CACHE_HOME=/tmp/cache MPLCONFIGDIR=/tmp/matplotlib
RUN useradd --uid 1000 bench && install --directory --mode 1777 /bench
USER 1000
WORKDIR /bench
ENTRYPOINT ["refseq"]
CMD ["--help"]
