// Requests to the course's part of the Jupyter server.

import { URLExt } from '@jupyterlab/coreutils';
import { ServerConnection } from '@jupyterlab/services';

/** POST to `course/...`; rejects with a sentence for the reader. */
export async function post(path: string, body: object): Promise<Response> {
  const settings = ServerConnection.makeSettings();
  const response = await ServerConnection.makeRequest(
    URLExt.join(settings.baseUrl, 'course', path),
    { method: 'POST', body: JSON.stringify(body) },
    settings
  );
  if (!response.ok) {
    throw await ServerConnection.ResponseError.create(response);
  }
  return response;
}

export const LONGEST = 3000; // ms between two tries to reach the server, and for its answer

/** Return the status with which the server answers a request, 0 if it does not answer. */
export async function answers(path: string): Promise<number> {
  const settings = ServerConnection.makeSettings();
  const url = URLExt.join(settings.baseUrl, path);
  try {
    return (await ServerConnection.makeRequest(url, { signal: AbortSignal.timeout(LONGEST) }, settings)).status;
  } catch {
    return 0;
  }
}
