# Stages: `page` builds the operator's page, `serve` is the small image that flies, `train` adds torch.
#   docker build --target serve -t uav-crowdsensing .
#   docker run --rm -p 8080:8080 -p 14550-14560:14550-14560/udp -v ucs-data:/data uav-crowdsensing
FROM node:22-bookworm-slim AS page
WORKDIR /src/gcs/dashboard
COPY gcs/dashboard/package.json gcs/dashboard/package-lock.json gcs/dashboard/.npmrc ./
RUN npm ci --no-audit --no-fund
COPY gcs/dashboard/ ./
RUN npm run build

FROM python:3.11-slim-bookworm AS wheel
WORKDIR /src
COPY . .
COPY --from=page /src/gcs/dashboard/dist gcs/dashboard/dist
RUN pip wheel --no-cache-dir --no-deps --wheel-dir /wheels .

FROM python:3.11-slim-bookworm AS serve
RUN useradd --create-home --uid 10001 ucs && mkdir /data && chown ucs:ucs /data
COPY --from=wheel /wheels /wheels
RUN pip install --no-cache-dir /wheels/*.whl
USER ucs
WORKDIR /data
ENV PYTHONUNBUFFERED=1 NUMBA_CACHE_DIR=/data/.numba
EXPOSE 8080
HEALTHCHECK --interval=10s --timeout=3s --start-period=20s \
    CMD python -c "import urllib.request as r; r.urlopen('http://127.0.0.1:8080/healthz', timeout=2)"
# Outside loopback the server refuses to start without keys: create them first with `gcs keys add`.
ENTRYPOINT ["gcs"]
CMD ["serve", "--host", "0.0.0.0", "--port", "8080"]

FROM serve AS train
USER root
RUN pip install --no-cache-dir "$(ls /wheels/*.whl)[train]"
USER ucs
ENTRYPOINT ["policy"]
CMD ["--help"]
